#include "processing/calibration/calibration.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "acquisition/frame/error.h"
#include "processing/calibration/ball_photographs.h"
#include "processing/calibration/first_lights.h"
#include "processing/calibration/highlight.h"
#include "processing/calibration/locate.h"
#include "processing/calibration/refine.h"
#include "processing/calibration/reflect.h"
#include "processing/calibration/warnings.h"

namespace darkbox {
namespace {

constexpr double hand_sigma_px = 0.5;          ///< a highlight read by hand
constexpr double ball_depth_sigma_mm = 10;     ///< balls stand about as far off as the object
constexpr double ball_size_tolerance = 0.002;  ///< of a diameter that tells a perspective camera the depth
constexpr double size_mismatch = 0.03;         ///< of the diameter: the scale or the diameter is wrong

using Readings = std::vector<std::optional<Highlight>>;  // one per frame

void require_a_name_for_each(std::size_t frames, const std::vector<std::string>& files) {
    if (frames == 0) throw InputError("there are no frames of the ball", "give at least three, one per lamp");
    if (frames != files.size())
        throw InputError(fmt::format("{} ball frames but {} names", frames, files.size()),
                         "give one name for each frame");
}

void require_frames(const std::vector<cv::Mat3f>& frames, const std::vector<std::string>& files) {
    require_a_name_for_each(frames.size(), files);
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

void require_names(const CalibrationOptions& options, const std::vector<std::string>& files) {
    for (const auto& [file, at] : options.highlights) index_of(file, files);
    for (const std::string& file : options.drop) index_of(file, files);
    if (options.nominal && options.nominal->position_in_rig_mm.size() != files.size())
        throw InputError(fmt::format("nominal.position_in_rig_mm has {} lamps for {} frames",
                                     options.nominal->position_in_rig_mm.size(), files.size()),
                         "give one for each frame, empty where it is not known");
}

std::string name_of(std::size_t ball, std::size_t balls) {
    return balls == 1 ? "the ball" : fmt::format("ball {}", ball + 1);
}

/// The ball on which a highlight was read by hand: the nearest one, and it must show the place.
std::size_t ball_at(const cv::Point2d& at, const std::string& file, const std::vector<LocatedBall>& balls) {
    const auto off = [&](const LocatedBall& b) { return std::hypot(at.x - b.ball.x, at.y - b.ball.y); };
    const auto nearest = std::min_element(balls.begin(), balls.end(), [&](const LocatedBall& a, const LocatedBall& b) {
        return off(a) - a.ball.radius < off(b) - b.ball.radius;
    });
    const Ball& ball = nearest->ball;
    if (!reflect_at(ball, at.x, at.y))
        throw InputError(
            fmt::format("the highlight of {} at ({:.1f}, {:.1f}) lies outside the ball", file, at.x, at.y),
            fmt::format("the ball is at ({:.1f}, {:.1f}) with radius {:.1f} pixels", ball.x, ball.y, ball.radius));
    return static_cast<std::size_t>(nearest - balls.begin());
}

/// What the frames show on every ball, by hand where the user read it.
std::vector<std::vector<HighlightReading>> read_balls(BallPhotographs& photographs,
                                                      const std::vector<std::string>& files,
                                                      const std::vector<LocatedBall>& balls,
                                                      const CalibrationOptions& options) {
    std::vector<cv::Rect> boxes;
    for (const LocatedBall& located : balls) boxes.push_back(mirror_box(located.ball, photographs.size()));
    std::vector<std::vector<cv::Mat3f>> frames = photographs.parts(boxes);
    std::vector<std::vector<HighlightReading>> readings;
    for (std::size_t b = 0; b < balls.size(); ++b) {
        const BallParts parts{boxes[b], std::move(frames[b])};
        readings.push_back(options.method == CalibrationMethod::refined ? find_highlights(parts, balls[b].ball)
                                                                        : find_brightest(parts, balls[b].ball));
    }
    for (const auto& [file, at] : options.highlights)
        readings[ball_at(at, file, balls)][index_of(file, files)] = {Highlight{at.x, at.y, hand_sigma_px, false}, "",
                                                                     0};
    for (const std::string& file : options.drop)
        for (auto& ball : readings) ball[index_of(file, files)] = {};
    return readings;
}

bool shows_anything(const std::vector<HighlightReading>& readings) {
    return std::any_of(readings.begin(), readings.end(), [](const auto& reading) { return bool(reading.highlight); });
}

/// Says in words what was not read, and keeps the rest.
void keep_readings(const std::vector<std::vector<HighlightReading>>& readings, const std::vector<std::string>& files,
                   Calibration& calibration) {
    const std::size_t balls = readings.size();
    for (const auto& ball : readings) {
        Readings kept;
        for (const HighlightReading& reading : ball) kept.push_back(reading.highlight);
        calibration.readings.push_back(std::move(kept));
    }
    calibration.highlights.resize(files.size());
    for (std::size_t i = 0; i < files.size(); ++i) {
        for (std::size_t b = 0; b < balls; ++b) {
            const HighlightReading& reading = readings[b][i];
            if (!calibration.highlights[i]) calibration.highlights[i] = reading.highlight;
            if (reading.highlight && reading.other_spots > 0)
                calibration.rejected.push_back(
                    fmt::format("{}: {} other bright spots on {}", files[i], reading.other_spots, name_of(b, balls)));
            if (balls > 1 && !reading.reason.empty())
                calibration.rejected.push_back(
                    fmt::format("{}: no highlight on ball {}: {}", files[i], b + 1, reading.reason));
        }
        const std::string& reason = readings.front()[i].reason;
        if (!calibration.highlights[i] && !reason.empty())
            calibration.warnings.push_back(
                fmt::format("{} has no usable highlight: {}; its light is left out", files[i], reason));
    }
}

/// A ball that shows no lamp at all is none, unless the user says that it is one.
void drop_dull_balls(std::vector<LocatedBall>& balls, std::vector<std::vector<HighlightReading>>& readings,
                     Calibration& calibration) {
    for (std::size_t b = balls.size(); b-- > 0;) {
        if (shows_anything(readings[b])) continue;
        const Ball& ball = balls[b].ball;
        if (balls.size() == 1)
            throw InputError("no frame shows a usable highlight on the ball",
                             "check that the frames show the ball, or say where it is with --ball X,Y,R");
        calibration.warnings.push_back(fmt::format(
            "what looks like a ball at ({:.1f}, {:.1f}) of radius {:.1f} shows no highlight; it is left out", ball.x,
            ball.y, ball.radius));
        balls.erase(balls.begin() + static_cast<std::ptrdiff_t>(b));
        readings.erase(readings.begin() + static_cast<std::ptrdiff_t>(b));
    }
}

/// The camera as known: given, or its scale told by a ball's diameter; else pixels serve as millimetres.
struct Scale {
    ViewGeometry view;
    bool known = false;
};

Scale scale_of(const CalibrationOptions& options, const Ball& ball, cv::Size size) {
    if (options.view) return {*options.view, true};
    Scale scale;
    scale.view.principal = {0.5 * (size.width - 1), 0.5 * (size.height - 1)};
    if (options.ball_diameter_mm) {
        scale.view.mm_per_pixel = 0.5 * *options.ball_diameter_mm / ball.radius;
        scale.known = true;
    }
    return scale;
}

BallObservations observed(const LocatedBall& located, const Readings& highlights, const Scale& scale,
                          const CalibrationOptions& options) {
    BallObservations ball;
    std::optional<double> radius;
    if (scale.view.perspective() && options.ball_diameter_mm) radius = 0.5 * *options.ball_diameter_mm;
    ball.sphere = sphere_of(scale.view, located.ball, radius);
    if (radius)
        ball.radius_sigma_mm = ball_size_tolerance * *radius;
    else if (scale.known)
        ball.depth_sigma_mm = ball_depth_sigma_mm;
    ball.contour = located.contour;
    ball.contour_sigma_px = located.contour_sigma_px;
    ball.shift_covariance = located.shift_covariance;
    if (located.sigma_px) {
        ball.outline = located.ball;
        ball.outline_sigma_px = *located.sigma_px;
    }
    ball.highlights = highlights;
    return ball;
}

void warn_of_sizes(const std::vector<MirrorSphere>& spheres, const CalibrationOptions& options,
                   Calibration& calibration) {
    if (!options.view || !options.ball_diameter_mm || options.view->perspective()) return;
    for (const MirrorSphere& sphere : spheres) {
        const double seen = 2 * sphere.radius_mm, given = *options.ball_diameter_mm;
        if (std::abs(seen - given) > size_mismatch * given)
            calibration.warnings.push_back(
                fmt::format("the ball's outline is {:.2f} mm wide at {:.4f} mm per pixel, but its diameter is given as "
                            "{:.2f} mm: check both",
                            seen, options.view->mm_per_pixel, given));
    }
}

LampModel lamp_model(const CalibrationOptions& options, const RaysToLamps& rays, const Scale& scale, cv::Size size,
                     std::size_t balls) {
    const double field = std::max(size.width, size.height) * scale.view.mm_per_pixel;
    if (options.lamps == LampModel::automatic)
        return choose_lamp_model(rays, options.nominal, scale.known ? std::optional(field) : std::nullopt);
    if (options.lamps == LampModel::near && !scale.known)
        throw InputError("near lamps have places in millimetres, but the scale of the pictures is not known",
                         "give the ball's diameter (--ball-diameter MM), or mm_per_pixel in rig.toml");
    if (options.lamps == LampModel::near && balls < 2 && !options.nominal)
        throw InputError("one ball tells the directions to near lamps but not their distances",
                         "put a second ball in view, or describe the lamps' positions in rig.toml");
    return options.lamps;
}

void read_directions_off(const RaysToLamps& rays, const std::vector<LocatedBall>& balls, const Scale& scale,
                         Calibration& calibration) {
    for (std::size_t i = 0; i < rays.size(); ++i) {
        if (rays[i].empty()) continue;
        calibration.lights[i].direction = rays[i].front().direction;
        calibration.lights[i].used = true;
    }
    for (const LocatedBall& located : balls) {
        const MirrorSphere sphere = sphere_of(scale.view, located.ball);
        calibration.balls.push_back(outline_of(scale.view, sphere, located.ball.confidence));
        if (!located.contour.empty())
            calibration.contour_rms_px = std::max(calibration.contour_rms_px, located.contour_spread_px);
    }
    calibration.method = "brightest";
}

void keep_light(const RefinedLight& refined, Light& light) {
    light.direction = refined.direction;
    light.covariance = refined.covariance;
    light.used = true;
    light.near = refined.near;
}

void keep_refined(const RefineResult& refined, const RefineInput& input, const std::vector<LocatedBall>& balls,
                  Calibration& calibration) {
    for (std::size_t i = 0; i < calibration.lights.size(); ++i)
        if (refined.lights[i]) keep_light(*refined.lights[i], calibration.lights[i]);
    for (std::size_t b = 0; b < refined.balls.size(); ++b) {
        const RefinedBall& ball = refined.balls[b];
        calibration.balls.push_back(outline_of(input.view, ball.sphere, balls[b].ball.confidence));
        calibration.contour_rms_px = std::max(calibration.contour_rms_px, ball.contour_rms_px);
        if (ball.rejected_points > 0)
            calibration.rejected.push_back(
                fmt::format("{} of {} contour points off the outline of {}, by up to {:.2f} px", ball.rejected_points,
                            input.balls[b].contour.size(), name_of(b, refined.balls.size()), ball.worst_rejected_px));
    }
    for (const RejectedHighlight& r : refined.rejected) {
        const std::string& file = calibration.lights[r.frame].file;
        calibration.rejected.push_back(
            fmt::format("{}: its highlight on {} lies {:.2f} px off what the other "
                        "observations say",
                        file, name_of(r.ball, refined.balls.size()), r.off_px));
        if (refined.balls.size() == 2)
            calibration.warnings.push_back(
                fmt::format("the two balls disagree about the lamp in {} by {:.2f} px; the highlight on ball {} is "
                            "left out, which may be the wrong one",
                            file, r.off_px, r.ball + 1));
    }
    for (const MisplacedLamp& lamp : refined.misplaced)
        calibration.warnings.push_back(
            fmt::format("the lamp in {} does not stand where the rig's description has it, but about {:.0f} mm away; "
                        "its place there was not used",
                        calibration.lights[lamp.frame].file, lamp.off_mm));
    calibration.method = "refined";
}

/// From which the object's samples are judged; zero for frames whose lamp no ball shows.
std::vector<Eigen::Vector3d> directions_at_object(const RaysToLamps& rays, const RefineInput& input) {
    std::vector<Eigen::Vector3d> directions;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        const Eigen::Vector3d start =
            input.lamps == LampModel::near ? Eigen::Vector3d(input.start[i] - input.object_mm) : input.start[i];
        directions.push_back(rays[i].empty() ? Eigen::Vector3d(0, 0, 0) : start.normalized());
    }
    return directions;
}

/// Lamps that the object sees elsewhere than the ball does.
void warn_of_disagreement(const RefineResult& refined, const RaysToLamps& rays, const RefineInput& input,
                          Calibration& calibration) {
    if (input.object.empty()) return;
    for (const RejectedHighlight& r : refined.rejected) {
        if (rays[r.frame].size() != 1 || !refined.lights[r.frame]) continue;
        const double apart = angle_deg(rays[r.frame].front().direction, refined.lights[r.frame]->direction);
        calibration.warnings.push_back(
            fmt::format("the object's pixels see the lamp of {} {:.1f} degrees from where the ball has it, and are "
                        "believed: it moved between the captures, or the surface is not matt",
                        calibration.lights[r.frame].file, apart));
    }
}

void refine_lights(const RaysToLamps& rays, RefineInput input, const std::vector<LocatedBall>& balls,
                   const CalibrationOptions& options, Calibration& calibration) {
    if (input.lamps == LampModel::near) {
        FirstPositions first = first_positions(rays, options.nominal);
        input.start = std::move(first.position_mm);
        input.distance_known = std::move(first.distance_known);
        input.nominal = options.nominal;
    } else {
        input.start = first_directions(rays);
        if (options.lamps == LampModel::distant) input.nominal = options.nominal;
    }
    input.object = lambert_samples(options.object_pixels, directions_at_object(rays, input));
    if (input.object.empty() && !options.object_pixels.empty())
        calibration.warnings.push_back(
            "the object's pixels do not follow Lambert's law under enough lamps, so that they say nothing of the "
            "lights; they were left out");
    const RefineResult refined = refine(input);
    if (!refined.converged)
        throw InputError("the ball's outline and the lights could not be refined together",
                         "check the highlights, or choose the method `brightest`");
    keep_refined(refined, input, balls, calibration);
    warn_of_disagreement(refined, rays, input, calibration);
    std::vector<MirrorSphere> spheres;
    for (const RefinedBall& ball : refined.balls) spheres.push_back(ball.sphere);
    warn_of_sizes(spheres, options, calibration);
}

/// A circle that the search found but no outline confirms may be what the ball mirrors.
void warn_of_lost_outlines(const std::vector<LocatedBall>& balls, const CalibrationOptions& options,
                           Calibration& calibration) {
    if (!options.balls.empty()) return;
    for (const LocatedBall& located : balls)
        if (located.contour.empty())
            calibration.warnings.push_back(fmt::format(
                "the outline of the ball at ({:.1f}, {:.1f}) of radius {:.1f} could not be measured, so that all "
                "lights "
                "may be off by tens of degrees: look at calibration/ball.png and give the circle with --ball X,Y,R",
                located.ball.x, located.ball.y, located.ball.radius));
}

Lights unread_lights(const std::vector<std::string>& files) {
    Lights lights(files.size());
    for (std::size_t i = 0; i < files.size(); ++i) {
        lights[i].file = files[i];
        lights[i].used = false;
    }
    return lights;
}

}  // namespace

Calibration calibrate(const std::vector<cv::Mat3f>& frames, const std::vector<std::string>& files,
                      const CalibrationOptions& options) {
    options.validate();
    require_frames(frames, files);
    BallFramesInMemory photographs(frames);
    return calibrate(photographs, files, options);
}

Calibration calibrate(BallPhotographs& photographs, const std::vector<std::string>& files,
                      const CalibrationOptions& options) {
    options.validate();
    require_a_name_for_each(photographs.count(), files);
    require_names(options, files);
    const cv::Size size = photographs.size();

    Calibration calibration;
    calibration.lights = unread_lights(files);
    std::vector<LocatedBall> balls = locate_balls(photographs, options);
    warn_of_lost_outlines(balls, options, calibration);
    auto readings = read_balls(photographs, files, balls, options);
    for (const std::string& file : options.drop)
        calibration.rejected.push_back(fmt::format("{}: left out as asked", file));
    drop_dull_balls(balls, readings, calibration);
    for (std::size_t b = 0; b < balls.size(); ++b)
        if (balls[b].rejected > 0)
            calibration.rejected.push_back(
                fmt::format("{} readings off the outline of {}", balls[b].rejected, name_of(b, balls.size())));
    keep_readings(readings, files, calibration);

    const Scale scale = scale_of(options, balls.front().ball, size);
    if (scale.known) calibration.view = scale.view;
    RefineInput input;
    input.view = scale.view;
    for (std::size_t b = 0; b < balls.size(); ++b)
        input.balls.push_back(observed(balls[b], calibration.readings[b], scale, options));
    input.object_mm = scale.view.point_at(options.object.value_or(cv::Point2d(size.width - 1, size.height - 1) * 0.5));
    const RaysToLamps rays = rays_to_lamps(input.view, input.balls, files.size());
    if (options.method == CalibrationMethod::brightest) {
        read_directions_off(rays, balls, scale, calibration);
    } else {
        input.lamps = lamp_model(options, rays, scale, size, balls.size());
        refine_lights(rays, std::move(input), balls, options, calibration);
    }
    calibration.condition_number = condition_number(calibration.lights);
    for (std::string& warning : warnings_about(calibration)) calibration.warnings.push_back(std::move(warning));
    return calibration;
}

}  // namespace darkbox
