#include "processing/calibration/edge_profile.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace darkbox {
namespace {

constexpr double offset_step_px = 0.125;
constexpr double ridge = 1e-4;               ///< keeps the fit solvable where no sample lies inside
constexpr double believed_share = 0.8;       ///< of the profiles, those explained best, tell the shape
constexpr double tied_residual = 3;          ///< one share for all may leave this much more
constexpr std::size_t enough_profiles = 60;  ///< tell the shape

double step_within(double depth_px, double blur_px) {
    return 0.5 * std::erfc(-depth_px / (blur_px * std::numbers::sqrt2));
}

/// sqrt(depth) for depth > 0, blurred: a sum over the blur's Gaussian.
double root_within(double depth_px, double blur_px) {
    constexpr int points = 48;
    constexpr double reach = 4;
    double sum = 0, weights = 0;
    for (int i = 0; i < points; ++i) {
        const double x = reach * (2 * (i + 0.5) / points - 1), weight = std::exp(-x * x / 2);
        weights += weight;
        sum += weight * std::sqrt(std::max(0.0, depth_px + blur_px * x));
    }
    return sum / weights;
}

/// depth for depth > 0, blurred.
double line_within(double depth_px, double blur_px) {
    const double x = depth_px / blur_px;
    return depth_px * step_within(depth_px, blur_px) + blur_px * std::exp(-x * x / 2) / std::sqrt(2 * std::numbers::pi);
}

struct ShapeFit {
    EdgeShape shape;
    double residual = 0;
};

/// Tries shapes on a thinned set of profiles.
class ShapeSearch {
public:
    ShapeSearch(const Profiles& profiles, double reach_px) : profiles_(profiles), reach_px_(reach_px) {
        const std::size_t stride = std::max<std::size_t>(1, profiles.values.size() / enough_profiles);
        for (std::size_t i = 0; i < profiles.values.size(); i += stride) chosen_.push_back(i);
    }

    ShapeFit with_own_shares() const {
        ShapeFit best = tried({1.0, std::nullopt});
        for (const double blur : blurs) improve(best, {blur, std::nullopt});
        for (double factor = 1.1; factor > 1.01; factor = std::sqrt(factor)) {
            const EdgeShape middle = best.shape;
            for (const double f : {1 / factor, factor}) improve(best, {middle.blur_px * f, std::nullopt});
        }
        return best;
    }

    /// The blur shows without the share, and both at once would trade one for the other.
    ShapeFit with_one_share(double blur_px) const {
        ShapeFit best = tried({blur_px, 0.5});
        for (int tenths = 0; tenths <= 13; ++tenths) improve(best, {blur_px, 0.1 * tenths});
        for (double step = 0.05; step > 0.005; step /= 2) {
            const double middle = *best.shape.mirrored_share;
            for (const double s : {middle - step, middle + step}) improve(best, {blur_px, std::max(0.0, s)});
        }
        return best;
    }

private:
    static constexpr std::array blurs{0.7, 0.85, 1.0, 1.2, 1.45, 1.75};

    ShapeFit tried(const EdgeShape& shape) const {
        const ProfileModel model(profiles_.half, profiles_.step_px, shape, reach_px_);
        std::vector<double> left;
        for (const std::size_t i : chosen_) left.push_back(model.least_residual(profiles_.values[i]));
        std::sort(left.begin(), left.end());
        ShapeFit fit{shape, 0};
        for (std::size_t i = 0; static_cast<double>(i) < believed_share * static_cast<double>(left.size()); ++i)
            fit.residual += left[i];
        return fit;
    }
    void improve(ShapeFit& best, const EdgeShape& shape) const {
        const ShapeFit fit = tried(shape);
        if (fit.residual < best.residual) best = fit;
    }

    const Profiles& profiles_;
    double reach_px_;
    std::vector<std::size_t> chosen_;
};

}  // namespace

ProfileModel::ProfileModel(int half, double step_px, const EdgeShape& shape, double reach_px)
    : tied_(shape.mirrored_share.has_value()) {
    const int n = 2 * half + 1, steps = static_cast<int>(reach_px / offset_step_px);
    const int per_step = static_cast<int>(std::lround(step_px / offset_step_px));
    const int deepest = steps + half * per_step;  // depths come in whole numbers of offset steps
    Eigen::MatrixX3d within(2 * deepest + 1, 3);
    for (int i = -deepest; i <= deepest; ++i) {
        const double depth = i * offset_step_px;
        within.row(i + deepest) << step_within(depth, shape.blur_px), root_within(depth, shape.blur_px),
            line_within(depth, shape.blur_px);
    }
    for (int i = -steps; i <= steps; ++i) {
        Eigen::MatrixXd basis(n, tied_ ? 3 : 4);
        for (int k = 0; k < n; ++k) {
            const auto at = within.row(i - (k - half) * per_step + deepest);
            if (tied_)
                basis.row(k) << 1 + (*shape.mirrored_share - 1) * at[0], at[1], at[2];
            else
                basis.row(k) << 1, at;
        }
        Eigen::MatrixXd normal = basis.transpose() * basis;
        normal.diagonal().tail<2>() *= 1 + ridge;
        const Eigen::LLT<Eigen::MatrixXd> factor(normal);
        offsets_.push_back(i * offset_step_px);
        explained_.emplace_back(factor.matrixL().solve(basis.transpose()));
    }
}

std::vector<double> ProfileModel::residuals(const Eigen::VectorXd& profile) const {
    const double all = profile.squaredNorm();
    std::vector<double> left;
    for (const Eigen::MatrixXd& rows : explained_) left.push_back(all - (rows * profile).squaredNorm());
    return left;
}

double ProfileModel::least_residual(const Eigen::VectorXd& profile) const {
    const std::vector<double> left = residuals(profile);
    return *std::min_element(left.begin(), left.end());
}

std::optional<ProfileEdge> ProfileModel::fit(const Eigen::VectorXd& profile) const {
    const std::vector<double> left = residuals(profile);
    const auto least = std::min_element(left.begin(), left.end());
    if (least == left.begin() || least == left.end() - 1) return std::nullopt;
    const auto i = static_cast<std::size_t>(least - left.begin());
    const double before = left[i - 1], at = left[i], after = left[i + 1], bend = before - 2 * at + after;
    const double shift = bend > 0 ? 0.5 * (before - after) / bend : 0;
    const double level = (profile.array() - profile.mean()).square().sum();
    return ProfileEdge{offsets_[i] + shift * offset_step_px,
                       std::sqrt(std::max(0.0, level - at) / static_cast<double>(profile.size())), at};
}

EdgeShape shape_of_edge(const Profiles& profiles, double reach_px) {
    const ShapeSearch search(profiles, reach_px);
    const ShapeFit own = search.with_own_shares(), one = search.with_one_share(own.shape.blur_px);
    return one.residual < tied_residual * own.residual ? one.shape : own.shape;
}

}  // namespace darkbox
