#include "rig/daemon/lamp_ageing.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <map>

namespace darkbox {
namespace {

constexpr double days_per_month = 365.25 / 12;
constexpr std::size_t fewest_readings = 3;

double median(std::vector<double> values) {
    if (values.empty()) return 0;
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::ranges::nth_element(values, middle);
    if (values.size() % 2 == 1) return *middle;
    return (*middle + *std::max_element(values.begin(), middle)) / 2;
}

using Readings = std::vector<LampAgeing::Reading>;

/// Theil and Sen: the median of the slopes of all pairs.
double median_slope(const Readings& readings) {
    std::vector<double> slopes;
    for (std::size_t i = 0; i < readings.size(); ++i)
        for (std::size_t j = i + 1; j < readings.size(); ++j)
            if (readings[j].day > readings[i].day)
                slopes.push_back((readings[j].relative - readings[i].relative) / (readings[j].day - readings[i].day));
    return median(std::move(slopes));
}

/// Of a least-squares slope with the same scatter; the median's is at most a few per cent larger for normal errors.
double slope_sigma(const Readings& readings, double slope, double start) {
    double mean = 0;
    for (const auto& r : readings) mean += r.day / static_cast<double>(readings.size());
    double squares = 0;
    std::vector<double> residuals;
    for (const auto& r : readings) {
        squares += (r.day - mean) * (r.day - mean);
        residuals.push_back(std::abs(r.relative - start - slope * r.day));
    }
    constexpr double sigma_per_median = 1.4826;
    return squares > 0 ? sigma_per_median * median(std::move(residuals)) / std::sqrt(squares) : 0;
}

LampAgeing fitted(const std::string& lamp, Readings readings) {
    const double first = readings.front().relative;
    for (auto& r : readings) r.relative /= first;
    const double slope = median_slope(readings);
    std::vector<double> starts;
    for (const auto& r : readings) starts.push_back(r.relative - slope * r.day);
    const double start = median(std::move(starts));
    const double at_first = start + slope * readings.front().day;
    const double at_last = start + slope * readings.back().day;
    return {.lamp = lamp,
            .readings = readings,
            .percent_per_month = 100 * slope * days_per_month / at_first,
            .sigma = 100 * slope_sigma(readings, slope, start) * days_per_month / at_first,
            .left = at_last / at_first};
}

}  // namespace

std::optional<LampAgeing> trend_of(const std::string& what, Readings readings) {
    if (readings.size() < fewest_readings || readings.front().day == readings.back().day) return std::nullopt;
    return fitted(what, std::move(readings));
}

std::optional<double> day_of_date(const std::string& when) {
    int year = 0, month = 0, day = 0;
    if (std::sscanf(when.c_str(), "%d-%d-%d", &year, &month, &day) != 3) return std::nullopt;
    const std::chrono::year_month_day date{std::chrono::year(year), std::chrono::month(static_cast<unsigned>(month)),
                                           std::chrono::day(static_cast<unsigned>(day))};
    if (!date.ok()) return std::nullopt;
    return static_cast<double>(std::chrono::sys_days(date).time_since_epoch().count());
}

std::vector<LampAgeing> lamp_ageing(const std::vector<DatedLights>& history) {
    std::vector<std::string> order;
    std::map<std::string, Readings> readings;
    for (const auto& [day, calibration] : history) {
        if (!calibration.intensities_known) continue;
        std::vector<double> all;
        for (const Light& light : calibration.lights)
            if (light.used) all.push_back(light.intensity.mean());
        const double typical = median(std::move(all));
        if (typical <= 0) continue;
        for (std::size_t i = 0; i < calibration.lights.size() && i < calibration.rig.lamps.size(); ++i) {
            const Light& light = calibration.lights[i];
            const std::string& lamp = calibration.rig.lamps[i];
            if (!light.used || lamp.empty() || light.intensity.mean() <= 0) continue;
            if (!readings.contains(lamp)) order.push_back(lamp);
            readings[lamp].push_back({day, light.intensity.mean() / typical});
        }
    }
    std::vector<LampAgeing> lamps;
    for (const std::string& lamp : order)
        if (readings[lamp].size() >= fewest_readings) lamps.push_back(fitted(lamp, readings[lamp]));
    return lamps;
}

std::string ageing_table(const std::vector<LampAgeing>& lamps) {
    std::string table = "lamp,readings,percent_per_month,sigma,left\n";
    for (const LampAgeing& l : lamps)
        table += fmt::format("{},{},{:.4f},{:.4f},{:.4f}\n", l.lamp, l.readings.size(), l.percent_per_month, l.sigma,
                             l.left);
    return table;
}

std::string ageing_picture(const std::vector<LampAgeing>& lamps) {
    constexpr int width = 900;
    constexpr int height = 480;
    constexpr int left = 70;
    constexpr int bottom = 430;
    constexpr int top = 30;
    constexpr int right = 730;
    constexpr std::array colours{"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                 "#e69f00", "#56b4e9", "#000000", "#999999"};
    std::string svg = fmt::format(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" height=\"{1}\" font-family=\"sans-serif\" "
        "font-size=\"13\"><rect width=\"{0}\" height=\"{1}\" fill=\"white\"/>\n",
        width, height);
    std::vector<LampAgeing> shown = lamps;
    std::ranges::sort(shown, std::greater(), [](const LampAgeing& l) { return std::abs(l.left - 1); });
    shown.resize(std::min(shown.size(), colours.size()));
    double first_day = 1e300, last_day = -1e300, low = 1, high = 1;
    for (const LampAgeing& lamp : shown)
        for (const auto& r : lamp.readings) {
            first_day = std::min(first_day, r.day);
            last_day = std::max(last_day, r.day);
            low = std::min(low, r.relative);
            high = std::max(high, r.relative);
        }
    low = std::floor(low * 20) / 20;
    high = std::ceil(high * 20) / 20 + (high == low ? 0.05 : 0);
    const double days = std::max(1.0, last_day - first_day);
    const auto x = [&](double day) { return left + (right - left) * (day - first_day) / days; };
    const auto y = [&](double value) { return bottom - (bottom - top) * (value - low) / (high - low); };
    for (double v = low; v < high + 0.01; v += 0.05)
        svg += fmt::format(
            "<path d=\"M{} {:.1f}H{}\" stroke=\"#ddd\"/><text x=\"{}\" y=\"{:.1f}\" text-anchor=\"end\">"
            "{:.0f} %</text>\n",
            left, y(v), right, left - 8, y(v) + 4, v * 100);
    for (double month = 0; month * days_per_month <= days; month += std::ceil(days / days_per_month / 10))
        svg += fmt::format("<text x=\"{:.1f}\" y=\"{}\" text-anchor=\"middle\">{:.0f}</text>\n",
                           x(first_day + month * days_per_month), bottom + 20, month);
    svg += fmt::format("<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">months since the first calibration</text>\n",
                       (left + right) / 2, bottom + 40);
    for (std::size_t i = 0; i < shown.size(); ++i) {
        std::string path;
        for (const auto& r : shown[i].readings)
            path += fmt::format("{}{:.1f} {:.1f}", path.empty() ? "M" : "L", x(r.day), y(r.relative));
        svg += fmt::format("<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.5\"/>\n", path, colours[i]);
        svg += fmt::format("<text x=\"{}\" y=\"{}\" fill=\"{}\">{} {:+.2f} %/month</text>\n", right + 10,
                           top + 10 + 20 * static_cast<int>(i), colours[i], shown[i].lamp, shown[i].percent_per_month);
    }
    return svg + "</svg>\n";
}

}  // namespace darkbox
