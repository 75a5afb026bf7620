#include "processing/calibration/calibration.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "acquisition/frame/error.h"
#include "processing/calibration/ball_contour.h"
#include "processing/calibration/ball_search.h"
#include "processing/calibration/highlight.h"
#include "processing/calibration/outline.h"
#include "processing/calibration/refine.h"
#include "processing/calibration/warnings.h"

namespace darkbox {
namespace {

constexpr double given_ball_sigma_px = 0.5;  ///< a circle drawn by hand
constexpr double hand_sigma_px = 0.5;        ///< a highlight read by hand
constexpr double least_support = 0.15;       ///< share of the outline below which contour points say nothing
constexpr double far_sigma_px = 1e3;         ///< of a circle that the contour alone decides
constexpr double least_contour_sigma_px = 0.05;

/// The ball and what is known of its outline.
struct LocatedBall {
    Circle circle;
    std::vector<cv::Point2d> contour;
    double contour_sigma_px = 0.3;
    double circle_sigma_px = far_sigma_px;
    double confidence = 1;
    std::size_t rejected = 0;
};

void require_frames(const std::vector<cv::Mat3f>& frames, const std::vector<std::string>& files) {
    if (frames.empty()) throw InputError("there are no frames of the ball", "give at least three, one per lamp");
    if (frames.size() != files.size())
        throw InputError(fmt::format("{} ball frames but {} names", frames.size(), files.size()),
                         "give one name for each frame");
    for (std::size_t i = 0; i < frames.size(); ++i)
        if (frames[i].empty() || frames[i].size() != frames.front().size())
            throw InputError(fmt::format("{} is {}x{} pixels but {} is {}x{}", files[i], frames[i].cols, frames[i].rows,
                                         files.front(), frames.front().cols, frames.front().rows),
                             "give ball frames of one size");
}

std::size_t index_of(const std::string& file, const std::vector<std::string>& files) {
    const auto at = std::find(files.begin(), files.end(), file);
    if (at == files.end())
        throw InputError(fmt::format("there is no frame named {}", file),
                         fmt::format("the frames are: {}", fmt::join(files, ", ")));
    return static_cast<std::size_t>(at - files.begin());
}

void require_inside(const Ball& ball, cv::Size size) {
    if (ball.x < 0 || ball.y < 0 || ball.x > size.width - 1 || ball.y > size.height - 1)
        throw InputError(fmt::format("the ball's centre ({:.1f}, {:.1f}) lies outside the picture of {}x{} pixels",
                                     ball.x, ball.y, size.width, size.height),
                         "give --ball X,Y,R in pixels from the top left corner");
    if (ball.radius > std::max(size.width, size.height))
        throw InputError(fmt::format("the ball's radius of {:.1f} pixels is larger than the picture of {}x{}",
                                     ball.radius, size.width, size.height),
                         "give --ball X,Y,R with the radius, in pixels");
}

LocatedBall located_by(const BallContour& contour) {
    LocatedBall ball;
    ball.circle = contour.circle;
    ball.contour = contour.points;
    ball.contour_sigma_px = std::max(contour.spread_px, least_contour_sigma_px);
    ball.confidence = std::min(1.0, contour.support);
    ball.rejected = contour.rejected;
    return ball;
}

LocatedBall locate_in_mask(const cv::Mat1b& mask, cv::Size size) {
    if (mask.size() != size)
        throw InputError(fmt::format("the ball's mask is {}x{} pixels but the frames are {}x{}", mask.cols, mask.rows,
                                     size.width, size.height),
                         "give a mask of the frames' size");
    return located_by(measure_mask(mask));
}

/// A circle given by hand stands; the method `refined` may move it within its uncertainty onto the outline it sees.
LocatedBall locate_near(const Ball& given, const std::vector<cv::Mat3f>& frames, CalibrationMethod method) {
    require_inside(given, frames.front().size());
    const Circle circle{given.x, given.y, given.radius};
    LocatedBall ball;
    if (method == CalibrationMethod::refined) {
        const BallContour contour = measure_contour(mean_over_frames(frames), circle);
        const double moved = std::hypot(contour.circle.x - circle.x, contour.circle.y - circle.y) +
                             std::abs(contour.circle.radius - circle.radius);
        if (contour.support >= least_support && moved < 6 * given_ball_sigma_px) ball = located_by(contour);
    }
    ball.circle = circle;
    ball.circle_sigma_px = given_ball_sigma_px;
    ball.confidence = 1;
    return ball;
}

LocatedBall locate(const std::vector<cv::Mat3f>& frames, const CalibrationOptions& options) {
    if (options.ball) return locate_near(*options.ball, frames, options.method);
    if (options.ball_mask) return locate_in_mask(*options.ball_mask, frames.front().size());
    const auto found = find_ball(frames);
    if (!found)
        throw InputError("no mirror ball was found in the frames",
                         "say where it is with --ball X,Y,R (pixels), or give --ball-mask");
    const BallContour contour = measure_contour(mean_over_frames(frames), {found->x, found->y, found->radius});
    LocatedBall ball = located_by(contour);
    if (contour.support < least_support) {
        ball.circle = {found->x, found->y, found->radius};
        ball.contour.clear();
        ball.circle_sigma_px = given_ball_sigma_px;
    }
    ball.confidence = found->confidence;
    return ball;
}

Ball as_ball(const Circle& circle, double confidence) { return {circle.x, circle.y, circle.radius, confidence}; }

/// Reads every frame's highlight, by hand where the user did, and says in words what was left out.
void read_highlights(const std::vector<cv::Mat3f>& frames, const std::vector<std::string>& files, const Ball& ball,
                     const CalibrationOptions& options, Calibration& calibration) {
    auto readings =
        options.method == CalibrationMethod::refined ? find_highlights(frames, ball) : find_brightest(frames, ball);
    for (const auto& [file, at] : options.highlights) {
        if (!reflect_at(ball, at.x, at.y))
            throw InputError(
                fmt::format("the highlight of {} at ({:.1f}, {:.1f}) lies outside the ball", file, at.x, at.y),
                fmt::format("the ball is at ({:.1f}, {:.1f}) with radius {:.1f} pixels", ball.x, ball.y, ball.radius));
        readings[index_of(file, files)] = {Highlight{at.x, at.y, hand_sigma_px, false}, "", 0};
    }
    for (const std::string& file : options.drop) {
        readings[index_of(file, files)] = {};
        calibration.rejected.push_back(fmt::format("{}: left out as asked", file));
    }
    for (std::size_t i = 0; i < files.size(); ++i) {
        calibration.highlights.push_back(readings[i].highlight);
        if (!readings[i].reason.empty())
            calibration.warnings.push_back(
                fmt::format("{} has no usable highlight: {}; its light is left out", files[i], readings[i].reason));
        if (readings[i].highlight && readings[i].other_spots > 0)
            calibration.rejected.push_back(
                fmt::format("{}: {} other bright spots on the ball", files[i], readings[i].other_spots));
    }
    if (std::none_of(calibration.highlights.begin(), calibration.highlights.end(),
                     [](const auto& h) { return bool(h); }))
        throw InputError("no frame shows a usable highlight on the ball",
                         "check that the frames show the ball, or say where it is with --ball X,Y,R");
}

Lights unread_lights(const std::vector<std::string>& files) {
    Lights lights(files.size());
    for (std::size_t i = 0; i < files.size(); ++i) {
        lights[i].file = files[i];
        lights[i].used = false;
    }
    return lights;
}

void read_directions_off(const LocatedBall& located, Calibration& calibration) {
    const Ball ball = as_ball(located.circle, located.confidence);
    for (std::size_t i = 0; i < calibration.lights.size(); ++i) {
        const auto& highlight = calibration.highlights[i];
        if (!highlight) continue;
        calibration.lights[i].direction = reflect_at(ball, highlight->u, highlight->v).value();
        calibration.lights[i].used = true;
    }
    calibration.balls = {ball};
    calibration.contour_rms_px = located.contour.empty() ? 0 : located.contour_sigma_px;
    calibration.method = "brightest";
}

void refine_directions(const LocatedBall& located, Calibration& calibration) {
    const RefineResult refined = refine(
        {located.circle, located.contour, located.contour_sigma_px, located.circle_sigma_px, calibration.highlights});
    if (!refined.converged)
        throw InputError("the ball's circle and the light directions could not be refined together",
                         "check the highlights, or choose the method `brightest`");
    for (std::size_t i = 0; i < calibration.lights.size(); ++i) {
        if (!refined.lights[i]) continue;
        calibration.lights[i].direction = refined.lights[i]->direction;
        calibration.lights[i].covariance = refined.lights[i]->covariance;
        calibration.lights[i].used = true;
    }
    calibration.balls = {as_ball(refined.circle, located.confidence)};
    calibration.contour_rms_px = refined.contour_rms_px;
    calibration.method = "refined";
}

}  // namespace

void CalibrationOptions::validate() const {
    if (ball && !(std::isfinite(ball->x) && std::isfinite(ball->y)))
        throw InputError(fmt::format("ball.x, ball.y are {}, {}", ball->x, ball->y), "allowed: numbers, in pixels");
    if (ball && !(std::isfinite(ball->radius) && ball->radius >= 3))
        throw InputError(fmt::format("ball.radius is {}", ball->radius), "allowed: 3 pixels or more");
    if (ball && ball_mask)
        throw InputError("both ball and ball_mask are given", "give one of them: each says where the ball is");
    for (const auto& [file, at] : highlights)
        if (!(std::isfinite(at.x) && std::isfinite(at.y)))
            throw InputError(fmt::format("highlights: {} is at ({}, {})", file, at.x, at.y),
                             "allowed: numbers, in pixels");
}

Calibration calibrate(const std::vector<cv::Mat3f>& frames, const std::vector<std::string>& files,
                      const CalibrationOptions& options) {
    options.validate();
    require_frames(frames, files);
    for (const auto& [file, at] : options.highlights) index_of(file, files);
    for (const std::string& file : options.drop) index_of(file, files);

    const LocatedBall located = locate(frames, options);
    Calibration calibration;
    calibration.lights = unread_lights(files);
    if (located.rejected > 0)
        calibration.rejected.push_back(fmt::format("{} points off the ball's outline", located.rejected));
    read_highlights(frames, files, as_ball(located.circle, located.confidence), options, calibration);
    if (options.method == CalibrationMethod::refined)
        refine_directions(located, calibration);
    else
        read_directions_off(located, calibration);
    calibration.condition_number = condition_number(calibration.lights);
    for (std::string& warning : warnings_about(calibration)) calibration.warnings.push_back(std::move(warning));
    return calibration;
}

}  // namespace darkbox
