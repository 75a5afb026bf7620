#include "processing/calibration/outline_fit.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace darkbox {
namespace {

constexpr double step_px = 0.5;
constexpr double table_step_px = 0.02;
constexpr double ridge = 1e-4;          ///< keeps the elimination solvable where no sample lies inside
constexpr double ellipse_sigma = 0.01;  ///< of the radius: half the axes' difference that a near camera makes
constexpr double most_move_px = 1;
constexpr double least_blur_px = 0.6, most_blur_px = 2.5;
constexpr double most_share = 1.5;
constexpr std::size_t sectors = 8;
constexpr std::size_t fewest_profiles = 40;
constexpr int most_steps = 25;
constexpr double unseen = 2;  ///< of errors, to the share that sectors show: the rest is alike all around. Simulated
constexpr double next_term = 0.5;  ///< of what the last term of the polynomial moved the circle, moves it the next
constexpr int parameters = 7;      ///< x, y, radius, ellipse (2), share, blur

using Parameters = Eigen::Matrix<double, parameters, 1>;
using Information = Eigen::Matrix<double, parameters, parameters>;

/// How many pixels of depth the polynomial is trusted with.
int half_of(double radius) { return static_cast<int>(std::lround(std::clamp(0.1 * radius, 3.0, 4.0) / step_px)); }

/// A step and the powers of phi, blurred, by depth below the outline.
class MirrorTable {
public:
    MirrorTable(double radius, double blur_px, int terms, double reach_px) : reach_px_(reach_px) {
        const int n = static_cast<int>(std::ceil(reach_px / table_step_px));
        rows_.setZero(2 * n + 1, terms + 1);
        for (int i = -n; i <= n; ++i) {
            const double depth = i * table_step_px;
            auto row = rows_.row(i + n);
            double weights = 0;
            for (int k = 0; k < points; ++k) {
                const double x = width * (2 * (k + 0.5) / points - 1), weight = std::exp(-x * x / 2);
                const double inside = std::max(0.0, depth + blur_px * x);
                const double phi = 2 * std::acos(std::max(-1.0, 1 - inside / radius));
                weights += weight;
                double power = weight;
                for (int term = 1; term <= terms; ++term) row[term] += power *= phi;
            }
            row /= weights;
            row[0] = 0.5 * std::erfc(-depth / (blur_px * std::numbers::sqrt2));
        }
    }
    Eigen::RowVectorXd at(double depth) const {
        const double x = (std::clamp(depth, -reach_px_, reach_px_) + reach_px_) / table_step_px;
        const auto i = std::min(static_cast<Eigen::Index>(x), rows_.rows() - 2);
        const double f = x - static_cast<double>(i);
        return (1 - f) * rows_.row(i) + f * rows_.row(i + 1);
    }

private:
    static constexpr int points = 64;
    static constexpr double width = 4;
    double reach_px_;
    Eigen::MatrixXd rows_;
};

/// One profile's residuals and their derivatives, level and polynomial eliminated.
struct Left {
    Eigen::VectorXd residual;
    Eigen::MatrixXd slope;      ///< by parameters
    Eigen::VectorXd by_offset;  ///< by the profile's own offset
    double noise2 = 0;          ///< variance of a sample
    double weight = 0;
};

class JointFit {
public:
    JointFit(const ReadProfile& read, const std::vector<double>& angles, const Circle& start, const EdgeShape& shape,
             int terms)
        : read_(read), angles_(angles), start_(start), terms_(terms), half_(half_of(start.radius)) {
        at_ << start.x, start.y, start.radius, 0, 0, shape.mirrored_share.value_or(0.5), shape.blur_px;
    }

    /// False where it comes to no rest.
    bool solve() {
        for (int step = 0; step < most_steps; ++step) {
            if (step % 2 == 0 && step < 6 && !read_around(Circle{at_[0], at_[1], at_[2]})) return false;
            if (!linearise()) return false;
            Parameters move = -information_.ldlt().solve(gradient_);
            if (!move.allFinite()) return false;
            const double largest = move.cwiseAbs().maxCoeff();
            if (largest > most_step) move *= most_step / largest;
            at_ += move;
            at_[5] = std::clamp(at_[5], 0.0, most_share);
            at_[6] = std::clamp(at_[6], least_blur_px, most_blur_px);
            if (std::hypot(at_[0] - start_.x, at_[1] - start_.y, at_[2] - start_.radius) > most_move_px) return false;
            if (step >= 5 && largest < 1e-4) break;
        }
        return linearise() && at_[6] > least_blur_px && at_[6] < most_blur_px && at_[5] < most_share;
    }

    Circle circle() const { return {at_[0], at_[1], at_[2]}; }
    EdgeShape shape() const { return {at_[6], at_[5]}; }

    /// Neighbours' errors are alike, sectors' are not.
    Eigen::Matrix3d covariance() const {
        Eigen::Matrix<double, parameters, sectors> pulls = Eigen::Matrix<double, parameters, sectors>::Zero();
        for (std::size_t i = 0; i < left_.size(); ++i)
            pulls.col(static_cast<Eigen::Index>(i * sectors / left_.size())) +=
                left_[i].weight * left_[i].slope.transpose() * left_[i].residual;
        const Information inverse = information_.inverse();
        constexpr double lost = static_cast<double>(sectors) / (sectors - 5);  // ellipse and prior take next to none
        const Information sandwich = lost * inverse * (pulls * pulls.transpose()) * inverse;
        return unseen * sandwich.topLeftCorner<3, 3>() + inverse.topLeftCorner<3, 3>();
    }

    void keep_readings(OutlineFit& fit) const {
        for (std::size_t i = 0; i < left_.size(); ++i) {
            const double bend = left_[i].by_offset.squaredNorm();
            const double own = bend > 0 ? -left_[i].by_offset.dot(left_[i].residual) / bend : 0;
            fit.offset_px.push_back(bent(i) + std::clamp(own, -most_own_px, most_own_px));
            fit.sigma_px.push_back(bend > 0 ? 1 / std::sqrt(left_[i].weight * bend) : 1e3);
        }
    }

private:
    static constexpr double most_step = 0.3;
    static constexpr double most_own_px = 1;

    bool read_around(const Circle& circle) {
        around_ = circle;
        profiles_.clear();
        for (const double angle : angles_) {
            profiles_.push_back(read_(circle, angle, half_, step_px));
            if (profiles_.back().size() == 0) return false;
        }
        return true;
    }

    double bent(std::size_t i) const { return at_[3] * std::cos(2 * angles_[i]) + at_[4] * std::sin(2 * angles_[i]); }
    /// Of the outline from the circle that the profiles were read around.
    double offset(std::size_t i) const {
        return (at_[0] - around_.x) * std::cos(angles_[i]) + (at_[1] - around_.y) * std::sin(angles_[i]) + at_[2] -
               around_.radius + bent(i);
    }

    Eigen::VectorXd residual(const Eigen::VectorXd& profile, double offset, double share, double blur_px,
                             const MirrorTable& table) const {
        Eigen::MatrixXd basis(profile.size(), terms_ + 1);
        // A blurred disc's half level lies inside its border.
        const double inwards = blur_px * blur_px / (2 * at_[2]);
        for (int k = -half_; k <= half_; ++k) {
            basis.row(k + half_) = table.at(offset - k * step_px - inwards);
            basis(k + half_, 0) = 1 + (share - 1) * basis(k + half_, 0);
        }
        Eigen::MatrixXd normal = basis.transpose() * basis;
        normal.diagonal().tail(terms_) *= 1 + ridge;
        return profile - basis * normal.llt().solve(basis.transpose() * profile);
    }

    bool linearise() {
        constexpr double h = 1e-3;
        const double share = at_[5], blur = at_[6], reach = half_ * step_px + 2 * most_move_px;
        const MirrorTable table(at_[2], blur, terms_, reach), blurrier(at_[2], blur + h, terms_, reach);
        left_.assign(profiles_.size(), {});
        std::vector<double> noises;
        for (std::size_t i = 0; i < profiles_.size(); ++i) {
            const Eigen::VectorXd& p = profiles_[i];
            Left& left = left_[i];
            const double o = offset(i), c = std::cos(angles_[i]), s = std::sin(angles_[i]);
            left.residual = residual(p, o, share, blur, table);
            left.by_offset = (residual(p, o + h, share, blur, table) - left.residual) / h;
            Eigen::RowVector<double, 5> moves;
            moves << c, s, 1, std::cos(2 * angles_[i]), std::sin(2 * angles_[i]);
            left.slope.resize(p.size(), parameters);
            left.slope.leftCols<5>() = left.by_offset * moves;
            left.slope.col(5) = (residual(p, o, share + h, blur, table) - left.residual) / h;
            left.slope.col(6) = (residual(p, o, share, blur + h, blurrier) - left.residual) / h;
            left.noise2 = left.residual.squaredNorm() / static_cast<double>(p.size() - terms_ - 1);
            noises.push_back(left.noise2);
        }
        const auto middle = noises.begin() + static_cast<std::ptrdiff_t>(noises.size() / 2);
        std::nth_element(noises.begin(), middle, noises.end());
        information_ = Information::Zero();
        gradient_ = Parameters::Zero();
        for (Left& left : left_) {
            left.weight = 1 / (left.noise2 + *middle + least_noise2);
            information_ += left.weight * left.slope.transpose() * left.slope;
            gradient_ += left.weight * left.slope.transpose() * left.residual;
        }
        const double prior = 1 / std::pow(ellipse_sigma * at_[2], 2);
        for (const int i : {3, 4}) {
            information_(i, i) += prior;
            gradient_[i] += prior * at_[i];
        }
        return information_.allFinite();
    }

    static constexpr double least_noise2 = 1e-16;

    const ReadProfile& read_;
    const std::vector<double>& angles_;
    Circle start_, around_;
    int terms_;
    int half_;
    Parameters at_;
    std::vector<Eigen::VectorXd> profiles_;
    std::vector<Left> left_;
    Information information_;
    Parameters gradient_;
};

}  // namespace

std::optional<OutlineFit> fit_outline(const ReadProfile& read, const std::vector<double>& angles, const Circle& start,
                                      const EdgeShape& shape) {
    if (angles.size() < fewest_profiles) return std::nullopt;
    JointFit coarse(read, angles, start, shape, 2);
    if (!coarse.solve()) return std::nullopt;
    JointFit fine(read, angles, coarse.circle(), coarse.shape(), 3);
    if (!fine.solve()) return std::nullopt;
    OutlineFit fit;
    fit.circle = fine.circle();
    fit.shape = fine.shape();
    fine.keep_readings(fit);
    const Eigen::Vector3d moved(fit.circle.x - coarse.circle().x, fit.circle.y - coarse.circle().y,
                                fit.circle.radius - coarse.circle().radius);
    fit.covariance = fine.covariance();
    const double aside = moved.head<2>().squaredNorm() / 2;
    fit.covariance.diagonal() += next_term * next_term * Eigen::Vector3d(aside, aside, moved[2] * moved[2]);
    if (!fit.covariance.allFinite()) return std::nullopt;
    return fit;
}

}  // namespace darkbox
