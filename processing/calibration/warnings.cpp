#include "processing/calibration/warnings.h"

#include <fmt/format.h>

#include "processing/calibration/light_geometry.h"

namespace darkbox {
namespace {

constexpr double poor_condition = 20;
constexpr double same_direction_deg = 1.0;
constexpr double rough_contour_px = 0.7;
constexpr double thin_support = 0.3;

void warn_of_geometry(const Calibration& calibration, std::vector<std::string>& warnings) {
    if (direction_matrix(calibration.lights).rows() >= 3 && calibration.condition_number > poor_condition)
        warnings.push_back(fmt::format("the lights nearly lie in one plane (condition number {:.0f}): {}",
                                       calibration.condition_number, in_words(light_geometry(calibration.lights))));
}

void warn_of_lights_behind(const Lights& lights, std::vector<std::string>& warnings) {
    for (const Light& light : lights)
        if (light.used && light.direction.z() <= 0)
            warnings.push_back(
                fmt::format("the light of {} lies behind the object: z must point to the viewer", light.file));
}

void warn_of_duplicates(const Lights& lights, std::vector<std::string>& warnings) {
    for (std::size_t i = 0; i < lights.size(); ++i)
        for (std::size_t j = i + 1; j < lights.size(); ++j) {
            if (!lights[i].used || !lights[j].used) continue;
            const double angle = angle_deg(lights[i].direction, lights[j].direction);
            if (angle < same_direction_deg)
                warnings.push_back(
                    fmt::format("{} and {} were lit from the same direction within {:.2f} degrees: is one "
                                "lamp named twice?",
                                lights[i].file, lights[j].file, angle));
        }
}

void warn_of_outline(const Calibration& calibration, std::vector<std::string>& warnings) {
    if (calibration.contour_rms_px > rough_contour_px)
        warnings.push_back(
            fmt::format("the ball's outline is {:.2f} pixels rms off a circle: is it a sphere seen from "
                        "afar, and sharp?",
                        calibration.contour_rms_px));
    for (const Ball& ball : calibration.balls)
        if (ball.confidence < thin_support)
            warnings.push_back(
                fmt::format("only {:.0f} % of the ball's outline can be seen: check that the circle at "
                            "({:.1f}, {:.1f}) of radius {:.1f} lies on it",
                            100 * ball.confidence, ball.x, ball.y, ball.radius));
}

}  // namespace

std::vector<std::string> warnings_about(const Calibration& calibration) {
    std::vector<std::string> warnings;
    warn_of_geometry(calibration, warnings);
    warn_of_lights_behind(calibration.lights, warnings);
    warn_of_duplicates(calibration.lights, warnings);
    warn_of_outline(calibration, warnings);
    return warnings;
}

}  // namespace darkbox
