#include "processing/calibration/contour_noise.h"

#include <algorithm>
#include <cmath>

namespace darkbox {
namespace {

constexpr double least_sigma_px = 0.02;
constexpr int slowest_wave = 2;
constexpr int fastest_wave = 5;
constexpr std::size_t fewest_points = 40;

}  // namespace

double ContourNoise::effective_sigma_px() const { return sigma_px * std::sqrt(readings_per_independent); }

ContourNoise contour_noise(const std::vector<cv::Point2d>& points, const std::vector<double>& distances_px,
                           const cv::Point2d& centre) {
    ContourNoise noise;
    if (points.empty()) return noise;
    const double count = static_cast<double>(points.size());
    double squares = 0;
    for (const double distance : distances_px) squares += distance * distance;
    const double variance = squares / count;
    noise.sigma_px = std::max(least_sigma_px, std::sqrt(variance));
    if (points.size() < fewest_points || !(variance > 0)) return noise;
    double power = 0;
    for (int wave = slowest_wave; wave <= fastest_wave; ++wave) {
        double cosine = 0, sine = 0;
        for (std::size_t i = 0; i < points.size(); ++i) {
            const double angle = wave * std::atan2(points[i].y - centre.y, points[i].x - centre.x);
            cosine += distances_px[i] * std::cos(angle);
            sine += distances_px[i] * std::sin(angle);
        }
        power += (cosine * cosine + sine * sine) / count;
    }
    const int waves = fastest_wave - slowest_wave + 1;
    noise.readings_per_independent = std::max(1.0, power / (waves * variance));
    return noise;
}

double robust_sigma(std::vector<double> values) {
    if (values.empty()) return 0;
    for (double& value : values) value = std::abs(value);
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return 1.4826 * *middle;
}

}  // namespace darkbox
