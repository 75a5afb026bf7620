#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "processing/formats/report/ellipse.h"
#include "processing/formats/report/html.h"
#include "processing/formats/report/plots.h"

namespace darkbox {
namespace {

constexpr double radius = 170;  // of the rim, SVG units
constexpr double half = 200;
constexpr double ellipse_size = 7;         // SVG units, of a typical light
constexpr std::size_t most_numbered = 32;  // beyond, numbers would cover each other; names are still shown on hover

struct Place {
    double x = 0;
    double y = 0;
    double off_axis_deg = 0;
};

/// The rim stands for 30, 60 or 90 degrees, so that lights close to the axis do not crowd in the middle.
double rim_deg(const Lights& lights) {
    double most = 0;
    for (const Light& light : lights) most = std::max(most, angle_deg(light.direction, {0, 0, 1}));
    return most < 28 ? 30 : most < 56 ? 60 : 90;
}

Place place_of(const Eigen::Vector3d& d, double rim) {
    const double off_axis = angle_deg(d, {0, 0, 1});
    const double along = std::hypot(d.x(), d.y());
    const double r = std::min(off_axis / rim, 1.1) * radius;
    return {along > 0 ? d.x() / along * r : 0, along > 0 ? -d.y() / along * r : 0, off_axis};
}

std::string ring(double degrees, double rim) {
    const double r = degrees / rim * radius;
    return fmt::format("<circle class='grid' r='{:.1f}'/><text class='tick' x='3' y='{:.1f}'>{:.0f}°</text>", r, -r - 3,
                       degrees);
}

std::string number_beside(const Place& p, std::size_t number) {
    return fmt::format("<text class='label' x='{:.2f}' y='{:.2f}'>{}</text>", p.x + 8, p.y - 6, number);
}

Mapping on_plot(double rim) {
    return [rim](const Eigen::Vector3d& direction) {
        const Place p = place_of(direction, rim);
        return Eigen::Vector2d(p.x, p.y);
    };
}

std::string mark(const Light& light, double rim, const std::string& label, double size, double magnification) {
    const Place p = place_of(light.direction, rim);
    const std::string sigma =
        light.sigma_deg() > 0 ? fmt::format(", standard deviation {:.3f}°", light.sigma_deg()) : std::string();
    return fmt::format(
        "<g class='{}'><title>{}: {:.1f}° off the camera's axis{}</title>{}<circle class='lamp' cx='{:.2f}' "
        "cy='{:.2f}' "
        "r='{}'/>{}</g>",
        light.used ? "used" : "unused", escaped(light.file), p.off_axis_deg, sigma,
        ellipse_svg(uncertainty(light, on_plot(rim)), {p.x, p.y}, magnification), p.x, p.y, size, label);
}

}  // namespace

double light_plot_magnification(const Lights& lights) {
    return magnification_for(lights, on_plot(rim_deg(lights)), ellipse_size);
}

std::string light_plot(const Lights& lights) {
    const double magnification = light_plot_magnification(lights);
    std::string svg = fmt::format(
        "<svg class='plot' viewBox='{0} {0} {1} {1}' role='img' aria-label='light directions'>", -half, 2 * half);
    const double rim = rim_deg(lights);
    for (int third = 1; third <= 3; ++third) svg += ring(third * rim / 3, rim);
    svg += fmt::format("<line class='grid' x1='-{0}' x2='{0}'/><line class='grid' y1='-{0}' y2='{0}'/>", radius);
    svg += fmt::format("<text class='tick' x='{}' y='14'>x</text><text class='tick' x='6' y='-{}'>y</text>", radius + 8,
                       radius + 14);
    const bool numbered = lights.size() <= most_numbered;
    for (std::size_t i = 0; i < lights.size(); ++i)
        svg += mark(lights[i], rim, numbered ? number_beside(place_of(lights[i].direction, rim), i + 1) : "",
                    numbered ? 4 : 3, magnification);
    return svg + "</svg>";
}

}  // namespace darkbox
