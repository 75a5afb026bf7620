#include "processing/pipeline/summary_json.h"

#include <numbers>
#include <optional>

#include "processing/calibration/intensity.h"
#include "processing/calibration/light_geometry.h"

namespace darkbox {
namespace {

using nlohmann::ordered_json;

ordered_json seconds_json(const StageSeconds& seconds) {
    return {{"read", seconds.read}, {"solve", seconds.solve}, {"write", seconds.write}};
}

ordered_json triple(const Eigen::Vector3d& v) { return {v[0], v[1], v[2]}; }

ordered_json light_json(const Light& light) {
    ordered_json json{{"file", light.file},
                      {"direction", triple(light.direction)},
                      {"sigma_deg", light.sigma_deg()},
                      {"intensity", triple(light.intensity)},
                      {"used", light.used}};
    if (light.near) json["position_mm"] = triple(light.near->position_mm);
    return json;
}

ordered_json ball_json(const Ball& ball) {
    ordered_json json{{"x", ball.x}, {"y", ball.y}, {"radius", ball.radius}, {"confidence", ball.confidence}};
    if (ball.ellipse)
        json["ellipse"] = {{"along", ball.ellipse->along},
                           {"across", ball.ellipse->across},
                           {"angle_deg", ball.ellipse->angle_rad * 180 / std::numbers::pi}};
    return json;
}

ordered_json number_or_null(const std::optional<double>& number) {
    return number ? ordered_json(*number) : ordered_json(nullptr);
}

ordered_json geometry_json(const LightGeometry& geometry) {
    return {{"normal_error_deg_per_percent_noise", number_or_null(geometry.noise_error_deg)},
            {"normal_error_deg_of_directions", number_or_null(geometry.direction_error_deg)},
            {"undetermined_share", geometry.undetermined_share}};
}

}  // namespace

ordered_json to_json(const CalibrateSummary& summary) {
    const Calibration& calibration = summary.calibration;
    ordered_json lights = ordered_json::array(), balls = ordered_json::array();
    for (const Light& light : calibration.lights) lights.push_back(light_json(light));
    for (const Ball& ball : calibration.balls) balls.push_back(ball_json(ball));
    const ordered_json blur = summary.blur_px ? ordered_json(*summary.blur_px) : ordered_json();
    return {{"method", calibration.method},
            {"lights", lights},
            {"balls", balls},
            {"blur_px", blur},
            {"intensity_origin", name(calibration.intensity_origin)},
            {"condition_number", calibration.condition_number},
            {"light_geometry", geometry_json(light_geometry(calibration.lights))},
            {"contour_rms_px", calibration.contour_rms_px},
            {"rejected", calibration.rejected},
            {"warnings", calibration.warnings},
            {"removed", summary.removed},
            {"seconds", seconds_json(summary.seconds)}};
}

ordered_json height_json(const HeightFacts& height) {
    return {{"unit", height.unit},      {"lowest", height.lowest},          {"highest", height.highest},
            {"parts", height.parts},    {"vertices", height.mesh.vertices}, {"faces", height.mesh.faces},
            {"seconds", height.seconds}};
}

ordered_json to_json(const NormalsSummary& summary) {
    ordered_json intensities = ordered_json::array();
    for (const Light& light : summary.lights)
        intensities.push_back({{"file", light.file}, {"intensity", triple(light.intensity)}});
    ordered_json json{{"solver", summary.solver},
                      {"body", summary.body},
                      {"gloss", summary.gloss},
                      {"intensity_origin", name(summary.intensity_origin)},
                      {"intensities", intensities},
                      {"images", summary.images},
                      {"pixels", summary.pixels},
                      {"residual_rms", summary.residual_rms},
                      {"seconds", seconds_json(summary.seconds)},
                      {"megapixel_images_per_second", summary.megapixel_images_per_second},
                      {"warnings", summary.warnings},
                      {"removed", summary.removed}};
    json["seconds"]["intensities"] = summary.intensity_seconds;
    for (const SampleShares& one : summary.shadows)
        json["shadows"].push_back({{"file", one.file},
                                   {"kept", one.kept},
                                   {"shadow", one.shadow},
                                   {"highlight", one.highlight},
                                   {"clipped", one.clipped}});
    if (summary.height) json["height"] = height_json(*summary.height);
    if (summary.mean_angular_error_deg) json["mean_angular_error_deg"] = *summary.mean_angular_error_deg;
    return json;
}

ordered_json to_json(const TexelsSummary& summary) {
    return {{"texels", summary.texels},
            {"within_cluster_variance", summary.within_cluster_variance},
            {"variance_explained", summary.variance_explained},
            {"seconds", seconds_json(summary.seconds)}};
}

ordered_json to_json(const ShadeSummary& summary) {
    return {{"texels", summary.texels},
            {"levels", summary.levels},
            {"samples", summary.samples},
            {"seconds", seconds_json(summary.seconds)}};
}

ordered_json to_json(const ReportSummary& summary) {
    ordered_json relit = ordered_json::array();
    for (const auto& file : summary.relit) relit.push_back(file.string());
    return {{"report", summary.file.string()},
            {"relit", relit},
            {"warnings", summary.warnings},
            {"seconds", summary.seconds}};
}

ordered_json to_json(const ProcessSummary& summary) {
    return {{"calibrate", to_json(summary.calibrate)},
            {"normals", to_json(summary.normals)},
            {"texels", to_json(summary.texels)},
            {"shade", to_json(summary.shade)},
            {"report", to_json(summary.report)}};
}

}  // namespace darkbox
