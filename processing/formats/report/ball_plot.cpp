#include <fmt/format.h>

#include "processing/formats/report/html.h"
#include "processing/formats/report/plots.h"

namespace darkbox {

std::string ball_plot(const ReportBall& ball) {
    // A pixel's centre is its integer coordinate, SVG's is half a unit further: hence -0.5.
    std::string svg = fmt::format(
        "<svg class='plot ball' viewBox='-0.5 -0.5 {0} {1}' role='img' aria-label='the mirror ball'><image x='-0.5' "
        "y='-0.5' width='{0}' height='{1}' href='{2}' style='image-rendering:pixelated'/>",
        ball.image.cols, ball.image.rows, data_uri(ball.image));
    const double stroke = ball.image.cols / 400.0;
    for (const Ball& outline : ball.balls)
        svg += fmt::format("<circle class='outline' cx='{:.2f}' cy='{:.2f}' r='{:.2f}' stroke-width='{:.2f}'/>",
                           outline.x, outline.y, outline.radius, stroke);
    for (const auto& [name, highlight] : ball.highlights)
        svg += fmt::format(
            "<g class='highlight' stroke-width='{4:.2f}'><title>{0}</title><circle cx='{1:.2f}' cy='{2:.2f}' "
            "r='{3:.2f}'/></g>",
            escaped(name), highlight.u, highlight.v, 6 * stroke, 1.3 * stroke);
    return svg + "</svg>";
}

}  // namespace darkbox
