#include "processing/calibration/refine.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "acquisition/frame/error.h"
#include "processing/calibration/adjustment.h"
#include "processing/calibration/reflect.h"

namespace darkbox {
namespace {

constexpr double rejected_sigmas = 4;
constexpr double least_contour_reject_px = 0.1;
constexpr double least_highlight_reject_px = 0.5;  ///< nearer than this no highlight is called wrong
constexpr double misplaced_slacks = 5;             ///< of NominalLamps::slack_mm
constexpr int most_rounds = 5;
constexpr int most_turns = 12;
constexpr double tolerated_misfit = 1.5;

void require_on_balls(const RefineInput& input) {
    for (const BallObservations& ball : input.balls)
        for (const auto& h : ball.highlights)
            if (h && !reflect_at(input.view, ball.sphere, {h->u, h->v}))
                throw InputError(fmt::format("the highlight at ({:.1f}, {:.1f}) lies outside the ball", h->u, h->v),
                                 "correct the highlight, or give the ball with --ball X,Y,R");
}

std::vector<Believed> all_of(const RefineInput& input) {
    std::vector<Believed> believed;
    for (const BallObservations& ball : input.balls) {
        Believed b;
        b.point.assign(ball.contour.size(), 1);
        for (const auto& highlight : ball.highlights) b.highlight.push_back(highlight ? 1 : 0);
        believed.push_back(std::move(b));
    }
    return believed;
}

/// Leaves out the points off the outline, and learns from the others how far one is to be believed.
void judge_contour(const BallObservations& ball, const std::vector<double>& distances, const Ball& outline,
                   Believed& believed, RefinedBall& result) {
    if (ball.contour.empty()) return;
    const double limit = std::max(least_contour_reject_px, rejected_sigmas * robust_sigma(distances));
    std::vector<cv::Point2d> points;
    std::vector<double> kept;
    result.rejected_points = 0;
    result.worst_rejected_px = 0;
    for (std::size_t i = 0; i < distances.size(); ++i) {
        const double own = ball.contour_sigma_px.empty() ? 0 : rejected_sigmas * ball.contour_sigma_px[i];
        believed.point[i] = std::abs(distances[i]) <= std::max(limit, own) ? 1 : 0;
        if (believed.point[i]) {
            points.push_back(ball.contour[i]);
            kept.push_back(distances[i]);
        } else {
            ++result.rejected_points;
            result.worst_rejected_px = std::max(result.worst_rejected_px, std::abs(distances[i]));
        }
    }
    const ContourNoise noise = contour_noise(points, kept, {outline.x, outline.y});
    believed.contour_sigma_px = noise.effective_sigma_px();
    result.contour_rms_px = noise.sigma_px;
    result.readings_per_independent = noise.readings_per_independent;
}

/// By how many standard deviations a highlight lies off; no value where it fits.
std::optional<double> misfit_sigmas(const RefineInput& input, const Adjustment& adjustment, std::size_t ball,
                                    std::size_t frame) {
    const auto off = adjustment.highlight_off_px(ball, frame);
    if (!off || *off < least_highlight_reject_px) return std::nullopt;
    const double sigmas = *off / input.balls[ball].highlights[frame]->sigma_px;
    return sigmas > rejected_sigmas ? std::optional(sigmas) : std::nullopt;
}

/// The worst misfit of each frame at most: when two disagree, leaving out one is all that can be said.
void judge_highlights(const RefineInput& input, const Adjustment& adjustment, std::vector<Believed>& believed,
                      std::vector<RejectedHighlight>& rejected) {
    for (std::size_t frame = 0; frame < input.start.size(); ++frame) {
        RejectedHighlight worst;
        double worst_sigmas = 0;
        for (std::size_t ball = 0; ball < input.balls.size(); ++ball) {
            const auto sigmas = misfit_sigmas(input, adjustment, ball, frame);
            if (!sigmas || *sigmas < worst_sigmas) continue;
            worst = {ball, frame, *adjustment.highlight_off_px(ball, frame)};
            worst_sigmas = *sigmas;
        }
        if (worst_sigmas == 0) continue;
        believed[worst.ball].highlight[frame] = 0;
        rejected.push_back(worst);
    }
}

/// The middle of the highlights' squared misfits over what it is where all errors are as large as believed.
double middle_misfit(const RefineInput& input, const Adjustment& adjustment) {
    std::vector<double> squares;
    for (std::size_t ball = 0; ball < input.balls.size(); ++ball)
        for (std::size_t frame = 0; frame < input.start.size(); ++frame)
            if (const auto off = adjustment.highlight_off_px(ball, frame))
                squares.push_back(std::pow(*off / input.balls[ball].highlights[frame]->sigma_px, 2));
    if (squares.empty()) return 0;
    const auto middle = squares.begin() + static_cast<std::ptrdiff_t>(squares.size() / 2);
    std::nth_element(squares.begin(), middle, squares.end());
    return *middle / (2 * std::numbers::ln2);  // the median of chi-squared with two degrees of freedom
}

/// No surface is quite Lambert's, and what it does otherwise is alike all over it. Where the object pulls most lamps
/// off their highlights, its samples are believed less, until lamp and highlight agree in the middle: a lamp that the
/// object then still sees elsewhere stands out.
void believe_object_as_it_deserves(RefineInput& input, const std::vector<Believed>& believed) {
    for (int turn = 0; turn < most_turns && !input.object.empty(); ++turn) {
        Adjustment robust(input, believed, Loss::robust);
        robust.solve();
        const double misfit = middle_misfit(input, robust);
        if (misfit < tolerated_misfit) return;
        input.object.samples_per_independent *= std::max(2.0, misfit);
    }
}

/// Whether the description pulled the lamp off everything that its frame shows.
bool no_highlight_fits(const RefineInput& input, const Adjustment& adjustment, std::size_t frame) {
    std::size_t seen = 0, off = 0;
    for (std::size_t ball = 0; ball < input.balls.size(); ++ball) {
        if (!adjustment.highlight_off_px(ball, frame)) continue;
        ++seen;
        if (misfit_sigmas(input, adjustment, ball, frame)) ++off;
    }
    return seen > 0 && off == seen;
}

/// Takes the places from which lamps turn out to be missing out of the description. Returns their frames.
std::vector<std::size_t> judge_description(const Adjustment& adjustment, RefineInput& input) {
    std::vector<std::size_t> misplaced;
    if (!input.nominal) return misplaced;
    for (std::size_t frame = 0; frame < input.start.size(); ++frame) {
        auto& place = input.nominal->position_in_rig_mm[frame];
        const auto off = place ? adjustment.off_place_mm(frame, *place) : std::nullopt;
        if (!off) continue;
        if (*off < misplaced_slacks * input.nominal->slack_mm && !no_highlight_fits(input, adjustment, frame)) continue;
        place.reset();
        misplaced.push_back(frame);
    }
    return misplaced;
}

RefinedLight near_light(const Eigen::Vector3d& position, const Eigen::Matrix3d& covariance,
                        const Eigen::Vector3d& object) {
    Light light;
    light.near = LampPosition{position, object, covariance};
    light = held_at(std::move(light), object);
    return {light.direction, light.covariance, light.near};
}

std::vector<std::optional<RefinedLight>> lights_of(const RefineInput& input, Adjustment& adjustment) {
    const std::vector<Eigen::Matrix3d> covariances = adjustment.lamp_covariances();
    std::vector<std::optional<RefinedLight>> lights(input.start.size());
    for (std::size_t i = 0; i < lights.size(); ++i) {
        const auto lamp = adjustment.lamp(i);
        if (!lamp) continue;
        lights[i] = input.lamps == LampModel::near ? near_light(*lamp, covariances[i], input.object_mm)
                                                   : RefinedLight{lamp->normalized(), covariances[i], std::nullopt};
    }
    return lights;
}

}  // namespace

RefineResult refine(const RefineInput& input) {
    require_on_balls(input);
    RefineResult result;
    result.balls.resize(input.balls.size());
    RefineInput trusted = input;  // less what the highlights contradict
    std::vector<Believed> believed = all_of(input);
    believe_object_as_it_deserves(trusted, believed);
    std::vector<std::size_t> misplaced;
    for (int round = 0; round < most_rounds; ++round) {
        Adjustment robust(trusted, believed, Loss::robust);
        robust.solve();
        for (std::size_t i = 0; i < input.balls.size(); ++i) {
            const MirrorSphere sphere = robust.sphere(i);
            judge_contour(input.balls[i], robust.contour_distances_px(i), outline_of(input.view, sphere), believed[i],
                          result.balls[i]);
        }
        const std::vector<std::size_t> missing = judge_description(robust, trusted);
        misplaced.insert(misplaced.end(), missing.begin(), missing.end());
        if (!missing.empty()) continue;  // highlights are judged without its pull
        const std::size_t before = result.rejected.size();
        judge_highlights(input, robust, believed, result.rejected);
        if (round > 0 && result.rejected.size() == before) break;
    }
    Adjustment final(trusted, believed, Loss::squares);
    result.converged = final.solve();
    for (std::size_t i = 0; i < input.balls.size(); ++i) result.balls[i].sphere = final.sphere(i);
    for (const std::size_t frame : misplaced)
        if (const auto off = final.off_place_mm(frame, *input.nominal->position_in_rig_mm[frame]))
            result.misplaced.push_back({frame, *off});
    result.lights = lights_of(trusted, final);
    return result;
}

}  // namespace darkbox
