#include "processing/formats/calibration_file.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <limits>

#include "processing/calibration/intensity.h"
#include "processing/formats/json_file.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using nlohmann::ordered_json;

ordered_json triple(const Eigen::Vector3d& v) { return {v[0], v[1], v[2]}; }
Eigen::Vector3d triple_in(const json& j) {
    return {j.at(0).get<double>(), j.at(1).get<double>(), j.at(2).get<double>()};
}

/// A symmetric matrix: xx, xy, xz, yy, yz, zz.
ordered_json matrix_json(const Eigen::Matrix3d& m) { return {m(0, 0), m(0, 1), m(0, 2), m(1, 1), m(1, 2), m(2, 2)}; }
Eigen::Matrix3d matrix_in(const json& j) {
    const auto c = j.get<std::array<double, 6>>();
    Eigen::Matrix3d m;
    m << c[0], c[1], c[2], c[1], c[3], c[4], c[2], c[4], c[5];
    return m;
}

/// Infinite distances, which JSON has no number for, are null.
ordered_json view_json(const ViewGeometry& view) {
    return {{"mm_per_pixel", view.mm_per_pixel},
            {"principal", {view.principal.x, view.principal.y}},
            {"distance_mm", view.perspective() ? ordered_json(view.distance_mm) : ordered_json(nullptr)}};
}
ViewGeometry view_in(const json& j) {
    ViewGeometry view;
    view.mm_per_pixel = j.at("mm_per_pixel").get<double>();
    view.principal = {j.at("principal").at(0).get<double>(), j.at("principal").at(1).get<double>()};
    if (!j.at("distance_mm").is_null()) view.distance_mm = j.at("distance_mm").get<double>();
    return view;
}

ordered_json highlight_json(const std::optional<Highlight>& highlight) {
    if (!highlight) return nullptr;
    return {
        {"u", highlight->u}, {"v", highlight->v}, {"sigma_px", highlight->sigma_px}, {"clipped", highlight->clipped}};
}

ordered_json light_json(const Light& light, const std::string& lamp, const std::optional<Highlight>& highlight) {
    ordered_json j{{"file", light.file},
                   {"lamp", lamp},
                   {"direction", triple(light.direction)},
                   {"sigma_deg", light.sigma_deg()},
                   {"covariance", matrix_json(light.covariance)},
                   {"intensity", triple(light.intensity)},
                   {"used", light.used}};
    if (highlight) j["highlight"] = highlight_json(highlight);
    if (light.near) {
        j["position_mm"] = triple(light.near->position_mm);
        j["object_mm"] = triple(light.near->object_mm);
        j["position_covariance_mm2"] = matrix_json(light.near->covariance_mm2);
    }
    return j;
}

Light light_in(const json& j) {
    Light light;
    light.file = j.at("file").get<std::string>();
    light.direction = triple_in(j.at("direction"));
    if (j.contains("covariance")) light.covariance = matrix_in(j.at("covariance"));
    if (j.contains("position_mm"))
        light.near = LampPosition{triple_in(j.at("position_mm")), triple_in(j.at("object_mm"))};
    if (j.contains("position_covariance_mm2")) light.near->covariance_mm2 = matrix_in(j.at("position_covariance_mm2"));
    light.intensity = triple_in(j.at("intensity"));
    light.used = j.at("used").get<bool>();
    return light;
}

std::optional<Highlight> highlight_in(const json& h) {
    if (h.is_null()) return std::nullopt;
    return Highlight{h.at("u").get<double>(), h.at("v").get<double>(), h.at("sigma_px").get<double>(),
                     h.at("clipped").get<bool>()};
}

/// A perspective camera's ball also has the half axes of its outline.
ordered_json ball_json(const Ball& ball) {
    ordered_json j{{"x", ball.x}, {"y", ball.y}, {"radius", ball.radius}, {"confidence", ball.confidence}};
    if (ball.ellipse)
        j["ellipse"] = {
            {"along", ball.ellipse->along}, {"across", ball.ellipse->across}, {"angle_rad", ball.ellipse->angle_rad}};
    return j;
}
Ball ball_in(const json& j) {
    Ball ball{j.at("x").get<double>(), j.at("y").get<double>(), j.at("radius").get<double>(),
              j.at("confidence").get<double>()};
    if (j.contains("ellipse")) {
        const json& e = j.at("ellipse");
        ball.ellipse =
            BallEllipse{e.at("along").get<double>(), e.at("across").get<double>(), e.at("angle_rad").get<double>()};
    }
    return ball;
}

/// Of several balls: what each shows of each light, [light][ball].
void read_readings(const json& light, Calibration& calibration) {
    if (!light.contains("highlights")) return;
    const json& of_balls = light.at("highlights");
    calibration.readings.resize(of_balls.size());
    for (std::size_t b = 0; b < of_balls.size(); ++b) calibration.readings[b].push_back(highlight_in(of_balls.at(b)));
}

/// Files of earlier versions do not say.
IntensityOrigin origin_in(const json& j) {
    const std::string origin = j.value("intensity_origin", name(IntensityOrigin::unknown));
    return intensity_origin_from_name(origin).value_or(IntensityOrigin::unknown);
}

StoredCalibration calibration_in(const json& j) {
    StoredCalibration stored;
    Calibration& calibration = stored.calibration;
    for (const json& light : j.at("lights")) {
        calibration.lights.push_back(light_in(light));
        calibration.highlights.push_back(highlight_in(light.value("highlight", json())));
        read_readings(light, calibration);
        stored.rig.lamps.push_back(light.value("lamp", ""));
    }
    stored.rig.name = j.value("rig", "");
    calibration.intensity_origin = origin_in(j);
    for (const json& ball : j.at("balls")) calibration.balls.push_back(ball_in(ball));
    if (calibration.readings.empty()) calibration.readings = {calibration.highlights};
    if (j.contains("view")) calibration.view = view_in(j.at("view"));
    const json& condition = j.at("condition_number");
    calibration.condition_number =
        condition.is_null() ? std::numeric_limits<double>::infinity() : condition.get<double>();
    calibration.contour_rms_px = j.at("contour_rms_px").get<double>();
    calibration.method = j.at("method").get<std::string>();
    calibration.warnings = j.at("warnings").get<std::vector<std::string>>();
    calibration.rejected = j.at("rejected").get<std::vector<std::string>>();
    return stored;
}

}  // namespace

void write_calibration(const fs::path& path, const Calibration& calibration, const RigIdentity& rig) {
    ordered_json lights = ordered_json::array(), balls = ordered_json::array();
    for (std::size_t i = 0; i < calibration.lights.size(); ++i)
        lights.push_back(light_json(calibration.lights[i], i < rig.lamps.size() ? rig.lamps[i] : "",
                                    i < calibration.highlights.size() ? calibration.highlights[i] : std::nullopt));
    for (const Ball& ball : calibration.balls) balls.push_back(ball_json(ball));
    if (calibration.readings.size() > 1)
        for (std::size_t i = 0; i < lights.size(); ++i)
            for (const auto& ball : calibration.readings) lights[i]["highlights"].push_back(highlight_json(ball[i]));
    ordered_json j{{"frame", "viewer: x right, y up, z from the object to the camera; pixels: u right, v down"},
                   {"rig", rig.name},
                   {"method", calibration.method},
                   {"intensity_origin", name(calibration.intensity_origin)},
                   {"condition_number", calibration.condition_number},  // infinity becomes null
                   {"contour_rms_px", calibration.contour_rms_px},
                   {"balls", balls},
                   {"lights", lights},
                   {"warnings", calibration.warnings},
                   {"rejected", calibration.rejected}};
    if (calibration.view) j["view"] = view_json(*calibration.view);
    write_json(path, j);
}

StoredCalibration read_calibration(const fs::path& path) {
    const json parsed = read_json(path);
    return reading_keys(path, "a calibration", [&] { return calibration_in(parsed); });
}

}  // namespace darkbox
