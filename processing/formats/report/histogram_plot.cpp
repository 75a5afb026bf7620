#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "processing/formats/report/plots.h"

namespace darkbox {
namespace {

constexpr double width = 400, height = 160, base = 20;

}  // namespace

std::string histogram_plot(const std::vector<double>& shares) {
    if (shares.empty()) return {};
    const double highest = std::sqrt(std::max(*std::max_element(shares.begin(), shares.end()), 1e-12));
    const double step = width / static_cast<double>(shares.size());
    std::string svg = fmt::format(
        "<svg class='plot wide' viewBox='0 0 {} {}' role='img' aria-label='exposure histogram'>", width, height + base);
    for (std::size_t i = 0; i < shares.size(); ++i) {
        const double tall = std::sqrt(std::max(shares[i], 0.0)) / highest * height;
        svg += fmt::format(
            "<rect class='bar' x='{:.2f}' y='{:.2f}' width='{:.2f}' height='{:.2f}'><title>{:.2f} … {:.2f}: {:.2f} %"
            "</title></rect>",
            static_cast<double>(i) * step, height - tall, step * 0.9, tall,
            static_cast<double>(i) / static_cast<double>(shares.size()),
            static_cast<double>(i + 1) / static_cast<double>(shares.size()), shares[i] * 100);
    }
    svg += fmt::format("<line class='axis' x1='0' x2='{0}' y1='{1}' y2='{1}'/>", width, height);
    for (const double tick : {0.25, 0.5, 0.75})
        svg += fmt::format(
            "<line class='axis' x1='{0:.1f}' x2='{0:.1f}' y1='{1}' y2='{2}'/><text class='tick middle' x='{0:.1f}' "
            "y='{3}'>{4:.2f}</text>",
            tick * width, height, height + 4, height + base - 4, tick);
    svg +=
        fmt::format("<text class='tick' x='0' y='{0}'>0</text><text class='tick end' x='{1}' y='{0}'>full scale</text>",
                    height + base - 4, width);
    return svg + "</svg>";
}

}  // namespace darkbox
