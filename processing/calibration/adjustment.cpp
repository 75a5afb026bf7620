#include "processing/calibration/adjustment.h"

#include <ceres/ceres.h>
#include <ceres/sphere_manifold.h>

#include <cmath>
#include <numbers>

#include "processing/calibration/lambert_cost.h"
#include "processing/calibration/reflect.h"
#include "processing/calibration/residuals.h"

namespace darkbox {
namespace {

constexpr double cauchy_scale = 2.0;         ///< standard deviations
constexpr double open_distance_sigma = 0.5;  ///< of the distance, where one ball must guess it
constexpr double log_intensity_sigma = 0.5;  ///< lamps of one make differ by less

ceres::LossFunction* loss_function(Loss loss) {
    return loss == Loss::robust ? new ceres::CauchyLoss(cauchy_scale) : nullptr;
}

}  // namespace

Adjustment::Adjustment(const RefineInput& input, const std::vector<Believed>& believed, Loss loss) : input_(input) {
    for (const BallObservations& ball : input.balls)
        spheres_.push_back(
            {ball.sphere.centre_mm.x(), ball.sphere.centre_mm.y(), ball.sphere.centre_mm.z(), ball.sphere.radius_mm});
    shifts_.resize(spheres_.size());
    for (std::size_t ball = 0; ball < spheres_.size(); ++ball) add_ball(ball, believed[ball], loss);
    add_lamps(believed);
    for (std::size_t ball = 0; ball < spheres_.size(); ++ball) add_highlights(ball, believed[ball], loss);
    if (input.nominal) add_nominal(*input.nominal);
    if (!input.object.empty()) add_object(input.object);
}

void Adjustment::add_ball(std::size_t i, const Believed& believed, Loss loss) {
    using Contour = ceres::AutoDiffCostFunction<ContourResidual, 1, 4>;
    using Prior = ceres::AutoDiffCostFunction<SpherePrior, 2, 4>;
    using Outline = ceres::AutoDiffCostFunction<OutlinePrior, 3, 4>;
    const BallObservations& ball = input_.balls[i];
    double* const sphere = spheres_[i].data();
    problem_.AddParameterBlock(sphere, 4);
    problem_.AddResidualBlock(new Prior(new SpherePrior{ball.sphere.centre_mm.z(), ball.depth_sigma_mm,
                                                        ball.sphere.radius_mm, ball.radius_sigma_mm}),
                              nullptr, sphere);
    if (ball.outline)
        problem_.AddResidualBlock(new Outline(new OutlinePrior{Viewing(input_.view), ball.outline->x, ball.outline->y,
                                                               ball.outline->radius, ball.outline_sigma_px}),
                                  nullptr, sphere);
    if (ball.shift_covariance) {
        add_shifting_contour(i, believed, loss);
        return;
    }
    for (std::size_t k = 0; k < ball.contour.size(); ++k)
        if (believed.point[k])
            problem_.AddResidualBlock(
                new Contour(new ContourResidual(input_.view, ball.contour[k], believed.contour_sigma_px)),
                loss_function(loss), sphere);
}

void Adjustment::add_shifting_contour(std::size_t i, const Believed& believed, Loss loss) {
    using Contour = ceres::AutoDiffCostFunction<ShiftedContourResidual, 1, 4, 3>;
    using Shift = ceres::AutoDiffCostFunction<VectorPrior, 3, 3>;
    const BallObservations& ball = input_.balls[i];
    const Eigen::Matrix3d root = ball.shift_covariance->llt().matrixL();
    const Ball outline = outline_of(input_.view, ball.sphere);
    double* const shift = shifts_[i].data();
    for (std::size_t k = 0; k < ball.contour.size(); ++k) {
        if (!believed.point[k]) continue;
        const Eigen::Vector2d out(ball.contour[k].x - outline.x, ball.contour[k].y - outline.y);
        const Eigen::Vector3d by_shift = root.transpose() * out.normalized().homogeneous();
        const double sigma = ball.contour_sigma_px.empty() ? believed.contour_sigma_px : ball.contour_sigma_px[k];
        problem_.AddResidualBlock(new Contour(new ShiftedContourResidual{
                                      ContourResidual(input_.view, ball.contour[k], sigma), by_shift / sigma}),
                                  loss_function(loss), spheres_[i].data(), shift);
    }
    problem_.AddResidualBlock(new Shift(new VectorPrior{{}, 1}), nullptr, shift);
}

void Adjustment::add_lamps(const std::vector<Believed>& believed) {
    lamps_.resize(input_.start.size());
    has_lamp_.assign(input_.start.size(), 0);
    const bool near = input_.lamps == LampModel::near;
    for (std::size_t frame = 0; frame < lamps_.size(); ++frame) {
        std::size_t seen = 0;
        for (const Believed& ball : believed) seen += ball.highlight[frame] ? 1U : 0U;
        if (seen == 0 && !input_.object.tells(frame)) continue;
        has_lamp_[frame] = 1;
        const Eigen::Vector3d& start = input_.start[frame];
        lamps_[frame] = {start.x(), start.y(), start.z()};
        double* const lamp = lamps_[frame].data();
        if (!near) {
            problem_.AddParameterBlock(lamp, 3, new ceres::SphereManifold<3>);
            continue;
        }
        problem_.AddParameterBlock(lamp, 3);
        if (seen > 1 && input_.distance_known[frame]) continue;
        if (input_.nominal && input_.nominal->position_in_rig_mm[frame]) continue;
        using Distance = ceres::AutoDiffCostFunction<DistancePrior, 1, 3>;
        const double distance = (start - input_.object_mm).norm();
        problem_.AddResidualBlock(
            new Distance(new DistancePrior{input_.object_mm, distance, open_distance_sigma * distance}), nullptr, lamp);
    }
}

void Adjustment::add_highlights(std::size_t i, const Believed& believed, Loss loss) {
    using Mirrored = ceres::AutoDiffCostFunction<HighlightResidual, 2, 4, 3>;
    const BallObservations& ball = input_.balls[i];
    for (std::size_t frame = 0; frame < ball.highlights.size(); ++frame) {
        if (!believed.highlight[frame]) continue;
        const Highlight& h = *ball.highlights[frame];
        HighlightResidual residual{Viewing(input_.view), h.u, h.v, h.sigma_px, input_.lamps == LampModel::near};
        const auto id = problem_.AddResidualBlock(new Mirrored(new HighlightResidual(residual)), loss_function(loss),
                                                  spheres_[i].data(), lamps_[frame].data());
        shown_.push_back({i, frame, id});
    }
}

void Adjustment::add_nominal(const NominalLamps& nominal) {
    using Pose = ceres::AutoDiffCostFunction<VectorPrior, 3, 3>;
    using Nominal = ceres::AutoDiffCostFunction<NominalResidual, 3, 3, 3, 3>;
    const double turn_sigma = nominal.turn_sigma_deg * std::numbers::pi / 180;
    problem_.AddResidualBlock(new Pose(new VectorPrior{{}, turn_sigma}), nullptr, turn_.data());
    problem_.AddResidualBlock(new Pose(new VectorPrior{{}, nominal.shift_sigma_mm}), nullptr, shift_.data());
    for (std::size_t frame = 0; frame < lamps_.size(); ++frame) {
        if (!has_lamp_[frame] || !nominal.position_in_rig_mm[frame]) continue;
        problem_.AddResidualBlock(new Nominal(new NominalResidual{*nominal.position_in_rig_mm[frame], nominal.slack_mm,
                                                                  input_.lamps == LampModel::near}),
                                  new ceres::HuberLoss(3.0), turn_.data(), shift_.data(), lamps_[frame].data());
    }
}

void Adjustment::add_object(const LambertSamples& object) {
    using Prior = ceres::AutoDiffCostFunction<NumberPrior, 1, 1>;
    const bool near = input_.lamps == LampModel::near;
    log_intensities_.assign(lamps_.size(), 0.0);
    for (std::size_t frame = 0; frame < lamps_.size(); ++frame) {
        if (!has_lamp_[frame] || !object.tells(frame)) continue;
        const double start = std::log(object.intensity[static_cast<Eigen::Index>(frame)]);
        log_intensities_[frame] = start;
        problem_.AddResidualBlock(new Prior(new NumberPrior{start, log_intensity_sigma}), nullptr,
                                  &log_intensities_[frame]);
    }
    for (std::size_t pixel = 0; pixel < object.at.size(); ++pixel) {
        std::vector<double> samples;
        std::vector<double*> lamps, intensities;
        double unit_mm = 0;
        for (std::size_t frame = 0; frame < lamps_.size(); ++frame) {
            const auto p = static_cast<Eigen::Index>(pixel), f = static_cast<Eigen::Index>(frame);
            if (!has_lamp_[frame] || !object.tells(frame) || object.kept(p, f) == 0) continue;
            samples.push_back(object.radiance(p, f));
            lamps.push_back(lamps_[frame].data());
            intensities.push_back(&log_intensities_[frame]);
            unit_mm += (input_.start[frame] - input_.object_mm).norm();
        }
        if (samples.size() <= 3) continue;  // its normal takes up all that they say
        const LambertCost::Geometry geometry{near, input_.view.point_at(object.at[pixel], input_.object_mm.z()),
                                             unit_mm / static_cast<double>(samples.size())};
        lamps.insert(lamps.end(), intensities.begin(), intensities.end());
        problem_.AddResidualBlock(
            new LambertCost(Eigen::Map<Eigen::VectorXd>(samples.data(), static_cast<Eigen::Index>(samples.size())),
                            object.effective_sigma(), geometry),
            nullptr, lamps);
    }
}

bool Adjustment::solve() {
    ceres::Solver::Options options;
    options.num_threads = 1;
    // The object ties all lamps together, so that nothing is left to eliminate.
    options.linear_solver_type = input_.object.empty() ? ceres::DENSE_SCHUR : ceres::DENSE_NORMAL_CHOLESKY;
    options.max_num_iterations = 200;
    options.function_tolerance = 1e-14;
    options.parameter_tolerance = 1e-12;
    options.gradient_tolerance = 1e-12;
    options.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem_, &summary);
    return summary.IsSolutionUsable();
}

MirrorSphere Adjustment::sphere(std::size_t ball) const {
    const auto& s = spheres_[ball];
    return {{s[0], s[1], s[2]}, s[3]};
}

std::optional<Eigen::Vector3d> Adjustment::lamp(std::size_t frame) const {
    if (!has_lamp_[frame]) return std::nullopt;
    return Eigen::Vector3d(lamps_[frame][0], lamps_[frame][1], lamps_[frame][2]);
}

std::vector<double> Adjustment::contour_distances_px(std::size_t ball) const {
    std::vector<double> distances;
    for (const cv::Point2d& p : input_.balls[ball].contour) {
        double distance = 0;
        ContourResidual(input_.view, p, 1.0)(spheres_[ball].data(), &distance);
        distances.push_back(distance);
    }
    return distances;
}

std::optional<double> Adjustment::highlight_off_px(std::size_t ball, std::size_t frame) const {
    for (const Shown& s : shown_) {
        if (s.ball != ball || s.frame != frame) continue;
        double cost = 0;
        std::array<double, 2> off{};
        problem_.EvaluateResidualBlock(s.residual, false, &cost, off.data(), nullptr);
        return std::hypot(off[0], off[1]) * input_.balls[ball].highlights[frame]->sigma_px;
    }
    return std::nullopt;
}

std::optional<double> Adjustment::off_place_mm(std::size_t frame, const Eigen::Vector3d& place_in_rig_mm) const {
    if (!has_lamp_[frame]) return std::nullopt;
    Eigen::Vector3d off;
    const NominalResidual residual{place_in_rig_mm, 1.0, input_.lamps == LampModel::near};
    residual(turn_.data(), shift_.data(), lamps_[frame].data(), off.data());
    return off.norm();
}

std::vector<Eigen::Matrix3d> Adjustment::lamp_covariances() {
    ceres::Covariance::Options options;
    options.num_threads = 1;
    options.algorithm_type = ceres::SPARSE_QR;
    options.sparse_linear_algebra_library_type = ceres::EIGEN_SPARSE;
    ceres::Covariance covariance(options);
    std::vector<std::pair<const double*, const double*>> blocks;
    for (std::size_t i = 0; i < lamps_.size(); ++i)
        if (has_lamp_[i]) blocks.emplace_back(lamps_[i].data(), lamps_[i].data());
    std::vector<Eigen::Matrix3d> covariances(lamps_.size(), Eigen::Matrix3d::Zero());
    if (blocks.empty() || !covariance.Compute(blocks, &problem_)) return covariances;
    for (std::size_t i = 0; i < lamps_.size(); ++i)
        if (has_lamp_[i])  // symmetric, so that the order of rows does not matter
            covariance.GetCovarianceBlock(lamps_[i].data(), lamps_[i].data(), covariances[i].data());
    return covariances;
}

}  // namespace darkbox
