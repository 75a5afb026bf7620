#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <utility>

#include "acquisition/frame/error.h"
#include "rig/description/lamp_section.h"
#include "rig/description/rig_description.h"

namespace darkbox {
namespace {

constexpr int fewest_lamps = 3;  ///< a normal has three unknowns
constexpr double dome_radius_mm = 1000;
constexpr double lowest_deg = 35;
constexpr double highest_deg = 75;

double radians(double degrees) { return degrees * std::numbers::pi / 180.0; }

/// Fibonacci's spiral: the golden angle between lamps and equal steps in height cover the zone of the dome evenly for
/// any count, and lamps that follow each other light the object from far apart. It starts at the top.
std::string lamp_toml(int lamp, int lamps) {
    const double golden_angle = std::numbers::pi * (3.0 - std::sqrt(5.0));
    const double along = static_cast<double>(lamp) / (lamps - 1);
    const double height = std::lerp(std::sin(radians(highest_deg)), std::sin(radians(lowest_deg)), along);
    const double in_plane = std::sqrt(1.0 - height * height);
    const double azimuth = golden_angle * lamp;
    return fmt::format(
        "\n[[lamps.lamp]]\nname = \"lamp-{:02}\"\nchannel = {}\nposition_mm = [{:.1f}, {:.1f}, {:.1f}]\n", lamp + 1,
        lamp, dome_radius_mm * in_plane * std::cos(azimuth), dome_radius_mm * in_plane * std::sin(azimuth),
        dome_radius_mm * height);
}

constexpr const char* head = R"(# A simulated rig: {0} lamps on a dome of one metre around the object.
[rig]
name = "simulated-{0}"

[camera]
driver = "sim"
exposure_ms = 20
gain = 1

[camera.intrinsics]
mm_per_pixel = 0.625

[ball]
diameter_mm = 36

[sim]
scene = "brick-torus"
width = 320
height = 240
bit_depth = 12

[lamps]
driver = "sim"
)";

}  // namespace

std::string simulated_rig_toml(int lamps) {
    if (lamps < fewest_lamps || std::cmp_greater(lamps, most_lamps))
        throw InputError(fmt::format("a simulated rig of {} lamps; allowed: {} to {}", lamps, fewest_lamps, most_lamps),
                         "normals need at least three lights");
    std::string toml = fmt::format(fmt::runtime(head), lamps);
    for (int lamp = 0; lamp < lamps; ++lamp) toml += lamp_toml(lamp, lamps);
    return toml;
}

}  // namespace darkbox
