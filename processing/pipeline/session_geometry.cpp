#include "processing/pipeline/session_geometry.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <opencv2/imgproc.hpp>

#include "processing/formats/calibration_file.h"
#include "processing/formats/exr.h"
#include "processing/formats/picture.h"
#include "processing/pipeline/session_files.h"

namespace darkbox {
namespace {

std::optional<ViewGeometry> view_of(const CaptureGeometry& geometry, cv::Size size) {
    if (!geometry.mm_per_pixel) return std::nullopt;
    ViewGeometry view;
    view.mm_per_pixel = *geometry.mm_per_pixel;
    view.principal = {0.5 * (size.width - 1), 0.5 * (size.height - 1)};
    if (geometry.principal_px) view.principal = {(*geometry.principal_px)[0], (*geometry.principal_px)[1]};
    if (geometry.camera_distance_mm) view.distance_mm = *geometry.camera_distance_mm;
    return view;
}

Eigen::Vector3d in_rig_mm(const NominalLamp& lamp) {
    return {lamp.position_mm[0], lamp.position_mm[1], lamp.position_mm[2]};
}

std::optional<NominalLamps> nominal_of(const CaptureGeometry& geometry, const std::vector<FrameRecord>& lit) {
    NominalLamps nominal;
    for (const FrameRecord& frame : lit) {
        const auto named = std::find_if(geometry.lamps.begin(), geometry.lamps.end(),
                                        [&](const NominalLamp& lamp) { return lamp.name == frame.lamp_name; });
        nominal.position_in_rig_mm.emplace_back();
        if (named == geometry.lamps.end()) continue;
        nominal.position_in_rig_mm.back() = in_rig_mm(*named);
    }
    const bool any = std::any_of(nominal.position_in_rig_mm.begin(), nominal.position_in_rig_mm.end(),
                                 [](const auto& place) { return bool(place); });
    return any ? std::optional(nominal) : std::nullopt;
}

}  // namespace

CalibrationOptions with_geometry(const Session& session, CalibrationOptions options, cv::Size size) {
    if (!options.object) options.object = object_centroid(session);
    const auto& geometry = session.info().geometry;
    if (!geometry) return options;
    if (!options.view) options.view = view_of(*geometry, size);
    if (!options.ball_diameter_mm) options.ball_diameter_mm = geometry->ball_diameter_mm;
    if (options.lamps == LampModel::automatic && geometry->distant_lamps) options.lamps = LampModel::distant;
    if (!options.nominal && options.lamps != LampModel::distant)
        options.nominal = nominal_of(*geometry, photographs_of(session, FrameKind::lit));
    return options;
}

std::vector<std::string> unused_geometry(const Session& session, const CalibrationOptions& options) {
    const auto& geometry = session.info().geometry;
    if (!geometry || options.view) return {};
    std::vector<std::string> words;
    const bool perspective = geometry->camera_distance_mm.has_value();
    if (perspective)
        words.push_back(
            fmt::format("the camera stands {:.0f} mm from the object, but the scale of its pictures is not known, so "
                        "that it was taken as orthographic: give mm_per_pixel in rig.toml",
                        *geometry->camera_distance_mm));
    if (options.nominal && options.lamps == LampModel::automatic && !options.ball_diameter_mm)
        words.push_back(
            "the rig's description has the lamps' places in millimetres, but the scale of the pictures is not known, "
            "so that the lamps were taken as distant: give the ball's diameter (--ball-diameter MM) or mm_per_pixel in "
            "rig.toml; if their light is parallel, say --lamps distant");
    return words;
}

std::optional<RigLights> described_lights(const Session& session) {
    const auto& geometry = session.info().geometry;
    if (!geometry || geometry->lamps.empty()) return std::nullopt;
    RigLights described{{session.info().rig, {}}, {}, false};
    for (const NominalLamp& lamp : geometry->lamps) {
        Light light;
        light.file = lamp.name;
        light.direction = in_rig_mm(lamp).normalized();
        described.rig.lamps.push_back(lamp.name);
        described.lights.push_back(light);
    }
    return described;
}

SceneGeometry scene_geometry(const ResultFiles& files) {
    SceneGeometry geometry;
    geometry.view = read_calibration(files.calibration).calibration.view;
    if (geometry.view && std::filesystem::exists(files.height))
        geometry.height_mm = read_exr_channel(files.height, "Y");
    return geometry;
}

std::optional<cv::Point2d> object_centroid(const Session& session) {
    const auto path = extra_of(session, object_mask);
    return path ? centroid_of(read_mask(*path)) : std::nullopt;
}

std::optional<cv::Point2d> centroid_of(const cv::Mat1b& mask) {
    const cv::Moments moments = cv::moments(mask, true);
    if (!(moments.m00 > 0)) return std::nullopt;
    return cv::Point2d(moments.m10 / moments.m00, moments.m01 / moments.m00);
}

}  // namespace darkbox
