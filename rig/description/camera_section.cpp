#include "rig/description/camera_section.h"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "rig/description/milliseconds.h"

namespace darkbox {
namespace {

constexpr double farthest_principal_px = 100'000;
constexpr double intrinsics_agree_within = 0.01;

/// Two of scale, distance and focal length tell the third: distance = focal length times scale.
void read_intrinsics(TomlSection& section, CameraDescription& camera) {
    section.allow({"mm_per_pixel", "distance_mm", "focal_length_px", "principal_px"});
    camera.mm_per_pixel = section.number("mm_per_pixel", {0.0001, 100});
    camera.distance_mm = section.number("distance_mm", {1, 1'000'000});
    const auto focal_length = section.number("focal_length_px", {1, 10'000'000});
    if (const auto point = section.numbers("principal_px", 2)) {
        camera.principal_px = {(*point)[0], (*point)[1]};
        for (const double coordinate : *point)
            if (std::abs(coordinate) > farthest_principal_px)
                section.fail("principal_px",
                             fmt::format("principal_px has {}; allowed: {} to {}", coordinate, -farthest_principal_px,
                                         farthest_principal_px),
                             "give the pixel at which the optical axis meets the picture: u right, v down");
    }
    if (camera.distance_mm && !camera.mm_per_pixel && !focal_length)
        section.fail("distance_mm", "distance_mm needs mm_per_pixel or focal_length_px beside it",
                     "add the scale at the object");
    if (!focal_length) return;
    if (camera.distance_mm && camera.mm_per_pixel) {
        const double told = *focal_length * *camera.mm_per_pixel;
        if (std::abs(told - *camera.distance_mm) > intrinsics_agree_within * *camera.distance_mm)
            section.fail("focal_length_px",
                         fmt::format("focal_length_px times mm_per_pixel is {:.1f} mm, but distance_mm is {:.1f}", told,
                                     *camera.distance_mm),
                         "give two of the three, or values that agree");
    } else if (camera.mm_per_pixel) {
        camera.distance_mm = *focal_length * *camera.mm_per_pixel;
    } else if (camera.distance_mm) {
        camera.mm_per_pixel = *camera.distance_mm / *focal_length;
    } else {
        section.fail("focal_length_px", "focal_length_px needs mm_per_pixel or distance_mm beside it",
                     "add the scale at the object, or the camera's distance from it");
    }
}

/// What is asked of a real camera's picture; a simulated one takes it from [sim].
void read_mode(TomlSection& section, CameraDescription& camera) {
    constexpr std::array keys{"format", "width", "height", "frame_rate", "crop"};
    for (const char* key : keys)
        if (section.has(key) && camera.driver != "v4l2")
            section.fail(key, fmt::format("{} does not belong to driver \"{}\"", key, camera.driver),
                         "leave it out, or set driver = \"v4l2\"");
    camera.format = section.text("format").value_or("");
    camera.width = static_cast<int>(section.integer("width", {1, 65'535}).value_or(0));
    camera.height = static_cast<int>(section.integer("height", {1, 65'535}).value_or(0));
    if ((camera.width == 0) != (camera.height == 0))
        section.fail(camera.width == 0 ? "height" : "width", "has one of width and height",
                     "give both, or neither for the largest picture");
    camera.frame_rate = section.number("frame_rate", {0.01, 10'000});
    if (const auto crop = section.numbers("crop", 4)) {
        camera.crop.emplace();
        for (std::size_t i = 0; i < crop->size(); ++i) {
            const double edge = (*crop)[i];
            if (edge < (i < 2 ? 0 : 1) || edge > 65'535 || edge != std::floor(edge))
                section.fail("crop",
                             fmt::format("crop holds {}; allowed: whole numbers up to 65535, a size from 1", edge),
                             "give left, top, width and height in pixels of the sensor");
            (*camera.crop)[i] = static_cast<int>(edge);
        }
    }
}

}  // namespace

CameraDescription read_camera(TomlSection& section) {
    CameraDescription camera;
    section.allow(
        {"driver", "device", "format", "width", "height", "frame_rate", "crop", "exposure_ms", "gain", "intrinsics"});
    camera.driver = section.choice("driver", camera.driver, {"v4l2", "sim"});
    camera.device = section.text("device").value_or("");
    camera.exposure =
        milliseconds(section.number("exposure_ms", {0.001, 60'000}).value_or(as_milliseconds(camera.exposure)));
    camera.gain = section.number("gain", {0.001, 1000}).value_or(camera.gain);
    read_mode(section, camera);
    if (auto intrinsics = section.section("intrinsics", "[camera.intrinsics]")) read_intrinsics(*intrinsics, camera);
    if (camera.driver == "v4l2" && camera.device.empty())
        section.fail("device", "device is missing; driver \"v4l2\" needs it",
                     "add device = \"/dev/v4l/by-id/...\" (ls /dev/v4l/by-id)");
    return camera;
}

}  // namespace darkbox
