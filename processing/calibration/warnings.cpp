#include "processing/calibration/warnings.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <numeric>

#include "processing/calibration/light_geometry.h"

namespace darkbox {
namespace {

constexpr double poor_condition = 20;
constexpr double same_direction_deg = 1.0;
constexpr double rough_contour_px = 0.7;
constexpr double thin_support = 0.3;
constexpr std::size_t most_named = 5;  // groups of lights, files of a group

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

/// Each used light's group, named by its first light: those that stand within `same_direction_deg` of one another,
/// directly or by way of others.
std::vector<std::size_t> groups_of(const Lights& lights) {
    std::vector<std::size_t> group(lights.size());
    std::iota(group.begin(), group.end(), std::size_t{0});
    for (std::size_t j = 1; j < lights.size(); ++j)
        for (std::size_t i = 0; i < j; ++i) {
            if (!lights[i].used || !lights[j].used || group[i] == group[j]) continue;
            if (angle_deg(lights[i].direction, lights[j].direction) >= same_direction_deg) continue;
            const auto [first, second] = std::minmax(group[i], group[j]);
            std::replace(group.begin(), group.end(), second, first);
        }
    return group;
}

/// All but the last of these files, the first few by name.
std::string named(const std::vector<std::string>& files) {
    const std::size_t others = files.size() - 1, shown = std::min(others, most_named);
    const auto first = files.begin(), end = first + static_cast<std::ptrdiff_t>(shown);
    const std::string names = fmt::format("{}", fmt::join(first, end, ", "));
    return shown == others ? names : fmt::format("{}, {} more", names, others - shown);
}

void warn_of_duplicates(const Lights& lights, std::vector<std::string>& warnings) {
    const std::vector<std::size_t> group = groups_of(lights);
    std::size_t groups = 0, in_groups = 0;
    for (std::size_t first = 0; first < lights.size(); ++first) {
        std::vector<std::string> files;
        double widest = 0;
        for (std::size_t i = first; i < lights.size(); ++i) {
            if (group[i] != first) continue;
            files.push_back(lights[i].file);
            for (std::size_t j = first; j < i; ++j)
                if (group[j] == first) widest = std::max(widest, angle_deg(lights[i].direction, lights[j].direction));
        }
        if (files.size() < 2) continue;
        ++groups;
        in_groups += files.size();
        if (groups > most_named) continue;
        warnings.push_back(
            fmt::format("{} and {} were lit from the same direction within {:.2f} degrees: is one lamp named {}?",
                        named(files), files.back(), widest, files.size() == 2 ? "twice" : "several times"));
    }
    if (groups > most_named)
        warnings.push_back(
            fmt::format("in all {} lights in {} groups share their direction with others within {:.0f} degree",
                        in_groups, groups, same_direction_deg));
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
