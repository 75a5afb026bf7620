#include "processing/calibration/refine.h"

#include <ceres/ceres.h>
#include <ceres/sphere_manifold.h>
#include <fmt/format.h>

#include <array>

#include "acquisition/frame/error.h"

namespace darkbox {
namespace {

/// A circle's or a direction's believed value.
struct PriorResidual {
    std::array<double, 3> value;
    double sigma;

    template <class T>
    bool operator()(const T* x, T* residual) const {
        for (std::size_t i = 0; i < 3; ++i) residual[i] = (x[i] - value[i]) / sigma;
        return true;
    }
};

/// The parameters in the arrays that Ceres changes, and the problem over them.
struct Adjustment {
    std::array<double, 3> circle{};
    std::vector<std::array<double, 3>> directions;  ///< of the frames with a highlight
    ceres::Problem problem;

    explicit Adjustment(const RefineInput& input);
};

std::array<double, 3> first_direction(const Circle& circle, const Highlight& highlight) {
    const auto light = reflect_at({circle.x, circle.y, circle.radius, 1.0}, highlight.u, highlight.v);
    if (!light)
        throw InputError(
            fmt::format("the highlight at ({:.1f}, {:.1f}) lies outside the ball", highlight.u, highlight.v),
            "correct the highlight, or give the ball with --ball X,Y,R");
    return {light->x(), light->y(), light->z()};
}

Adjustment::Adjustment(const RefineInput& input) : circle{input.circle.x, input.circle.y, input.circle.radius} {
    using Contour = ceres::AutoDiffCostFunction<ContourResidual, 1, 3>;
    using Reflection = ceres::AutoDiffCostFunction<HighlightResidual, 2, 3, 3>;
    using Prior = ceres::AutoDiffCostFunction<PriorResidual, 3, 3>;

    problem.AddParameterBlock(circle.data(), 3);
    problem.AddResidualBlock(new Prior(new PriorResidual{circle, input.circle_sigma_px}), nullptr, circle.data());
    for (const cv::Point2d& p : input.contour)
        problem.AddResidualBlock(new Contour(new ContourResidual{p.x, p.y, input.contour_sigma_px}),
                                 new ceres::CauchyLoss(2.0), circle.data());
    directions.reserve(input.highlights.size());  // Ceres keeps addresses
    for (const auto& highlight : input.highlights) {
        if (!highlight) continue;
        directions.push_back(first_direction(input.circle, *highlight));
        problem.AddParameterBlock(directions.back().data(), 3, new ceres::SphereManifold<3>);
        problem.AddResidualBlock(new Reflection(new HighlightResidual{highlight->u, highlight->v, highlight->sigma_px}),
                                 nullptr, circle.data(), directions.back().data());
    }
}

ceres::Solver::Summary solve(Adjustment& adjustment) {
    ceres::Solver::Options options;
    options.num_threads = 1;
    options.linear_solver_type = ceres::DENSE_QR;
    options.max_num_iterations = 100;
    options.function_tolerance = 1e-14;
    options.parameter_tolerance = 1e-12;
    options.gradient_tolerance = 1e-12;
    options.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &adjustment.problem, &summary);
    return summary;
}

/// Of the unit vectors, in the viewer frame, rad^2: rank two each. Zero where it cannot be had.
std::vector<Eigen::Matrix3d> direction_covariances(Adjustment& adjustment) {
    ceres::Covariance::Options options;
    options.num_threads = 1;
    options.algorithm_type = ceres::DENSE_SVD;
    options.null_space_rank = -1;
    ceres::Covariance covariance(options);
    std::vector<std::pair<const double*, const double*>> blocks;
    for (const auto& direction : adjustment.directions) blocks.emplace_back(direction.data(), direction.data());
    std::vector<Eigen::Matrix3d> covariances(adjustment.directions.size(), Eigen::Matrix3d::Zero());
    if (blocks.empty() || !covariance.Compute(blocks, &adjustment.problem)) return covariances;
    for (std::size_t i = 0; i < covariances.size(); ++i) {
        covariance.GetCovarianceBlock(blocks[i].first, blocks[i].second, covariances[i].data());  // symmetric
    }
    return covariances;
}

double contour_rms(const std::vector<cv::Point2d>& contour, const Circle& circle) {
    if (contour.empty()) return 0;
    double squares = 0;
    for (const cv::Point2d& p : contour) squares += circle.distance(p) * circle.distance(p);
    return std::sqrt(squares / static_cast<double>(contour.size()));
}

}  // namespace

RefineResult refine(const RefineInput& input) {
    Adjustment adjustment(input);
    const ceres::Solver::Summary summary = solve(adjustment);
    const std::vector<Eigen::Matrix3d> covariances = direction_covariances(adjustment);

    RefineResult result;
    result.converged = summary.IsSolutionUsable();
    result.circle = {adjustment.circle[0], adjustment.circle[1], adjustment.circle[2]};
    result.contour_rms_px = contour_rms(input.contour, result.circle);
    std::size_t next = 0;
    for (const auto& highlight : input.highlights) {
        result.lights.emplace_back();
        if (!highlight) continue;
        const auto& d = adjustment.directions[next];
        result.lights.back() = RefinedLight{Eigen::Vector3d(d[0], d[1], d[2]).normalized(), covariances[next]};
        ++next;
    }
    return result;
}

}  // namespace darkbox
