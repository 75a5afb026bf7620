#include "tests/processing/calibration/sweep.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/processing/calibration/ball_scene.h"

namespace darkbox::test {
namespace {

using Eigen::Vector3d;
using Lamps = SweepSetting::Lamps;

constexpr double ball_radius_mm = 18;
constexpr double lamp_distance_mm = 1000;
constexpr double camera_distance_mm = 800;
constexpr double slack_mm = 10;

/// Everything of one capture that is known exactly.
struct Capture {
    SphereScene scene;
    std::vector<Vector3d> lamps;       ///< directions or places
    std::vector<Vector3d> directions;  ///< at the object
};

Capture arranged(const SweepSetting& setting, int index) {
    Capture capture;
    SphereScene& scene = capture.scene;
    scene.mm_per_pixel = ball_radius_mm / setting.radius_px;
    scene.rays_per_pixel_side = std::max(4, static_cast<int>(240 / setting.radius_px));  // small lamps stay round
    scene.lamp_radiance = setting.lamp_radiance;
    scene.wall = setting.wall;
    scene.near = setting.lamps != Lamps::distant;
    scene.lamp_radius = scene.near ? 50 : 0.05;
    scene.room = 31 * setting.seed + static_cast<std::uint64_t>(index);
    if (setting.perspective) scene.camera_distance = camera_distance_mm;
    const double fraction = index * 0.6180339887 - std::floor(index * 0.6180339887);
    const double other = index * 0.7548776662 - std::floor(index * 0.7548776662);
    const Vector3d nudge(fraction * scene.mm_per_pixel, other * scene.mm_per_pixel, 0);
    const double width_mm = scene.near ? 170 : 85, height_mm = 54;
    scene.size =
        cv::Size(static_cast<int>(width_mm / scene.mm_per_pixel), static_cast<int>(height_mm / scene.mm_per_pixel));
    const double ball_x = scene.near ? -60 : -18, object_x = scene.near ? 40 : 22;
    scene.balls.push_back({Vector3d(ball_x, 0, 0) + nudge, ball_radius_mm});
    scene.object = {{object_x, 0, 0}, 14};
    if (setting.lamps == Lamps::near_two_balls) {
        scene.balls.push_back({Vector3d(62, 0, 0) - nudge, ball_radius_mm});
        scene.object.centre.x() = 0;
    }
    for (const Vector3d& d : dome_of_lights(setting.lights)) {
        const Eigen::AngleAxisd turn(1.1 * index, Vector3d::UnitZ());
        const Vector3d direction = turn * d;
        capture.lamps.push_back(scene.near ? Vector3d(lamp_distance_mm * direction) : direction);
        capture.directions.push_back(
            scene.near ? Vector3d((lamp_distance_mm * direction - scene.object.centre).normalized()) : direction);
    }
    return capture;
}

/// The description's lamps: the rig a little turned, each lamp a little elsewhere.
NominalLamps nominal_of(const Capture& capture, NormalNumbers& random) {
    NominalLamps nominal;
    nominal.slack_mm = slack_mm;
    nominal.turn_sigma_deg = 1;
    nominal.shift_sigma_mm = 5;
    const double turn_sigma = nominal.turn_sigma_deg * std::numbers::pi / 180;
    const Vector3d axis = turn_sigma * Vector3d(random.next(), random.next(), random.next());
    const Eigen::AngleAxisd turn(axis.norm(), axis.normalized());
    const Vector3d shift = 5 * Vector3d(random.next(), random.next(), random.next());
    for (const Vector3d& place : capture.lamps)
        nominal.position_in_rig_mm.emplace_back(turn * (place - shift) +
                                                slack_mm * Vector3d(random.next(), random.next(), random.next()));
    return nominal;
}

CalibrationOptions options_of(const SweepSetting& setting, const Capture& capture, NormalNumbers& random) {
    CalibrationOptions options;
    const SphereScene& scene = capture.scene;
    const cv::Point2d principal(0.5 * (scene.size.width - 1), 0.5 * (scene.size.height - 1));
    const ViewGeometry view{scene.mm_per_pixel, principal, scene.camera_distance};
    if (scene.near || setting.perspective) {
        options.view = view;
        options.ball_diameter_mm = 2 * ball_radius_mm;
        options.object = view.project(scene.object.centre);
        options.lamps = scene.near ? LampModel::near : LampModel::distant;
    }
    if (setting.lamps == Lamps::near_one_ball) options.nominal = nominal_of(capture, random);
    if (scene.balls.size() > 1)
        for (const auto& ball : scene.balls) {
            const cv::Point2d at = view.project(ball.centre);
            options.balls.push_back({std::round(at.x), std::round(at.y), std::round(setting.radius_px), 1.0});
        }
    return options;
}

/// Calibrates both ways and keeps how far the lights are off.
void compare(const std::vector<cv::Mat3f>& frames, CalibrationOptions options, const Capture& capture,
             SweepErrors& errors) {
    const auto names = frame_names(frames.size());
    const Calibration refined = calibrate(frames, names, options);
    options.method = CalibrationMethod::brightest;
    const Calibration raw = calibrate(frames, names, options);
    for (std::size_t i = 0; i < frames.size(); ++i) {
        if (raw.lights[i].used) errors.raw_deg.push_back(angle_deg(raw.lights[i].direction, capture.directions[i]));
        if (!refined.lights[i].used) {
            ++errors.unread;
            continue;
        }
        errors.refined_deg.push_back(angle_deg(refined.lights[i].direction, capture.directions[i]));
        errors.chi_squared.push_back(chi_squared(refined.lights[i], capture.directions[i]));
    }
}

double percent_point(double probability) { return -2 * std::log(1 - probability); }  // two degrees of freedom

}  // namespace

double SweepErrors::share_below(double probability) const {
    const auto below = std::lower_bound(chi_squared.begin(), chi_squared.end(), percent_point(probability));
    return static_cast<double>(below - chi_squared.begin()) / static_cast<double>(chi_squared.size());
}

double chi_squared(const Light& light, const Vector3d& truth) {
    Eigen::Matrix<double, 3, 2> tangent;
    tangent.col(0) = light.direction.unitOrthogonal();
    tangent.col(1) = light.direction.cross(tangent.col(0));
    const Eigen::Vector2d error = tangent.transpose() * (truth - light.direction);
    const Eigen::Matrix2d covariance = tangent.transpose() * light.covariance * tangent;
    return error.dot(covariance.inverse() * error);
}

std::vector<SweepErrors> sweep(const SweepSetting& setting) {
    std::vector<SweepErrors> errors(setting.full_wells_e.size());
    for (int index = 0; index < setting.captures; ++index) {
        const Capture capture = arranged(setting, index);
        NormalNumbers random(977 * setting.seed + static_cast<std::uint64_t>(index));
        const CalibrationOptions options = options_of(setting, capture, random);
        const SphereRenderer renderer(capture.scene);
        std::vector<cv::Mat1f> clean;
        for (const Vector3d& lamp : capture.lamps) clean.push_back(renderer.render(lamp));
        for (std::size_t level = 0; level < errors.size(); ++level) {
            std::vector<cv::Mat3f> frames;
            for (const cv::Mat1f& image : clean) {
                SensorNoise noise;
                noise.full_well_e = setting.full_wells_e[level];
                noise.seed = 7919 * setting.seed + 131 * static_cast<std::uint64_t>(index) + 17 * level + frames.size();
                frames.push_back(photographed(image, noise));
            }
            compare(frames, options, capture, errors[level]);
        }
    }
    for (SweepErrors& e : errors)
        for (auto* values : {&e.raw_deg, &e.refined_deg, &e.chi_squared}) std::sort(values->begin(), values->end());
    return errors;
}

void gather(SweepErrors& into, const SweepErrors& more) {
    const auto merge = [](std::vector<double>& a, const std::vector<double>& b) {
        a.insert(a.end(), b.begin(), b.end());
        std::sort(a.begin(), a.end());
    };
    merge(into.raw_deg, more.raw_deg);
    merge(into.refined_deg, more.refined_deg);
    merge(into.chi_squared, more.chi_squared);
    into.unread += more.unread;
}

}  // namespace darkbox::test
