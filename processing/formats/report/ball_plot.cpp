#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "processing/formats/report/ellipse.h"
#include "processing/formats/report/html.h"
#include "processing/formats/report/page_picture.h"
#include "processing/formats/report/plots.h"

namespace darkbox {

namespace {

constexpr double ellipse_share = 0.03;  // of the picture's width, for a typical light

const Ball* ball_around(const std::vector<Ball>& balls, const Highlight& highlight) {
    for (const Ball& ball : balls)
        if (std::hypot(highlight.u - ball.x, highlight.v - ball.y) <= ball.radius) return &ball;
    return nullptr;
}

/// Where a ball mirrors a light: at the normal half way between the light and the camera.
Mapping mirrored_on(const Ball& ball) {
    return [ball](const Eigen::Vector3d& direction) {
        const Eigen::Vector3d normal = (direction + Eigen::Vector3d(0, 0, 1)).normalized();
        return Eigen::Vector2d(ball.x + ball.radius * normal.x(), ball.y - ball.radius * normal.y());
    };
}

const Light* light_named(const Lights& lights, const std::string& file) {
    const auto found = std::find_if(lights.begin(), lights.end(), [&](const Light& l) { return l.file == file; });
    return found == lights.end() ? nullptr : &*found;
}

}  // namespace

double ball_plot_magnification(const ReportBall& ball, const Lights& lights) {
    return ball.balls.empty()
               ? 1.0
               : magnification_for(lights, mirrored_on(ball.balls.front()), ellipse_share * ball.image.cols);
}

std::string ball_plot(const ReportBall& ball, const Lights& lights) {
    const double magnification = ball_plot_magnification(ball, lights);
    // A pixel's centre is its integer coordinate, SVG's is half a unit further: hence -0.5.
    std::string svg = fmt::format(
        "<svg class='plot ball' viewBox='-0.5 -0.5 {0} {1}' role='img' aria-label='the mirror ball'><image x='-0.5' "
        "y='-0.5' width='{0}' height='{1}' href='{2}' style='image-rendering:pixelated'/>",
        ball.image.cols, ball.image.rows, data_uri(for_page(ball.image)));
    const double stroke = ball.image.cols / 400.0;
    for (const Ball& outline : ball.balls)
        svg += fmt::format("<circle class='outline' cx='{:.2f}' cy='{:.2f}' r='{:.2f}' stroke-width='{:.2f}'/>",
                           outline.x, outline.y, outline.radius, stroke);
    for (const auto& [name, highlight] : ball.highlights) {
        const Ball* around = ball_around(ball.balls, highlight);
        const Light* light = light_named(lights, name);
        const std::string sigma =
            around != nullptr && light != nullptr
                ? ellipse_svg(uncertainty(*light, mirrored_on(*around)), {highlight.u, highlight.v}, magnification)
                : std::string();
        svg += fmt::format(
            "<g class='highlight' stroke-width='{4:.2f}'><title>{0}</title>{5}<circle cx='{1:.2f}' cy='{2:.2f}' "
            "r='{3:.2f}'/></g>",
            escaped(name), highlight.u, highlight.v, 6 * stroke, 1.3 * stroke, sigma);
    }
    return svg + "</svg>";
}

}  // namespace darkbox
