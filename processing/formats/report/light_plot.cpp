#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "processing/formats/report/ellipse.h"
#include "processing/formats/report/html.h"
#include "processing/formats/report/plots.h"

namespace darkbox {
namespace {

constexpr double radius = 170;  // of the 90 degree rim, SVG units
constexpr double half = 200;
constexpr double ellipse_size = 7;         // SVG units, of a typical light
constexpr std::size_t most_numbered = 32;  // beyond, numbers would cover each other; names are still shown on hover

struct Place {
    double x = 0;
    double y = 0;
    double off_axis_deg = 0;
};

Place place_of(const Eigen::Vector3d& d) {
    const double off_axis = angle_deg(d, {0, 0, 1});
    const double along = std::hypot(d.x(), d.y());
    const double r = std::min(off_axis / 90.0, 1.1) * radius;
    return {along > 0 ? d.x() / along * r : 0, along > 0 ? -d.y() / along * r : 0, off_axis};
}

std::string ring(double degrees) {
    const double r = degrees / 90.0 * radius;
    return fmt::format("<circle class='grid' r='{:.1f}'/><text class='tick' x='3' y='{:.1f}'>{:.0f}°</text>", r, -r - 3,
                       degrees);
}

std::string number_beside(const Place& p, std::size_t number) {
    return fmt::format("<text class='label' x='{:.2f}' y='{:.2f}'>{}</text>", p.x + 8, p.y - 6, number);
}

Eigen::Vector2d on_plot(const Eigen::Vector3d& direction) {
    const Place p = place_of(direction);
    return {p.x, p.y};
}

std::string mark(const Light& light, const std::string& label, double size, double magnification) {
    const Place p = place_of(light.direction);
    const std::string sigma =
        light.sigma_deg() > 0 ? fmt::format(", standard deviation {:.3f}°", light.sigma_deg()) : std::string();
    return fmt::format(
        "<g class='{}'><title>{}: {:.1f}° off the camera's axis{}</title>{}<circle class='lamp' cx='{:.2f}' "
        "cy='{:.2f}' "
        "r='{}'/>{}</g>",
        light.used ? "used" : "unused", escaped(light.file), p.off_axis_deg, sigma,
        ellipse_svg(uncertainty(light, on_plot), {p.x, p.y}, magnification), p.x, p.y, size, label);
}

}  // namespace

double light_plot_magnification(const Lights& lights) { return magnification_for(lights, on_plot, ellipse_size); }

std::string light_plot(const Lights& lights) {
    const double magnification = light_plot_magnification(lights);
    std::string svg = fmt::format(
        "<svg class='plot' viewBox='{0} {0} {1} {1}' role='img' aria-label='light directions'>", -half, 2 * half);
    for (const double degrees : {30.0, 60.0, 90.0}) svg += ring(degrees);
    svg += fmt::format("<line class='grid' x1='-{0}' x2='{0}'/><line class='grid' y1='-{0}' y2='{0}'/>", radius);
    svg += fmt::format("<text class='tick' x='{}' y='14'>x</text><text class='tick' x='6' y='-{}'>y</text>", radius + 8,
                       radius + 14);
    const bool numbered = lights.size() <= most_numbered;
    for (std::size_t i = 0; i < lights.size(); ++i)
        svg += mark(lights[i], numbered ? number_beside(place_of(lights[i].direction), i + 1) : "", numbered ? 4 : 3,
                    magnification);
    return svg + "</svg>";
}

}  // namespace darkbox
