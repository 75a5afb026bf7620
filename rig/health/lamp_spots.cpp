#include "rig/health/lamp_spots.h"

#include <algorithm>
#include <cmath>

#include "processing/calibration/highlight.h"
#include "rig/health/luminance.h"

namespace darkbox {
namespace {

constexpr double spot_share = 0.1;  ///< of the ball's radius: a spot lies within this around its middle
constexpr double least_spot_px = 3;
constexpr double sure_of_light = 5;  ///< standard deviations

double spot_radius(const Ball& ball) { return std::max(least_spot_px, spot_share * ball.radius); }

/// Light above the ring around it, over a disc.
struct SpotLight {
    double sum = 0;
    double sigma = 0;
    double brightest = 0;
};

SpotLight light_at(const cv::Mat1f& picture, cv::Point2d at, double radius) {
    std::vector<float> disc, ring;
    const int reach = static_cast<int>(std::ceil(1.8 * radius));
    const cv::Point middle(static_cast<int>(std::lround(at.x)), static_cast<int>(std::lround(at.y)));
    for (int v = std::max(0, middle.y - reach); v <= std::min(picture.rows - 1, middle.y + reach); ++v)
        for (int u = std::max(0, middle.x - reach); u <= std::min(picture.cols - 1, middle.x + reach); ++u) {
            const double distance = std::hypot(u - at.x, v - at.y);
            if (distance <= radius)
                disc.push_back(picture(v, u));
            else if (distance <= 1.8 * radius)
                ring.push_back(picture(v, u));
        }
    if (disc.empty() || ring.size() < 8) return {};
    const auto median = [](std::vector<float>& values) {
        const auto half = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
        std::nth_element(values.begin(), half, values.end());
        return double(*half);
    };
    const double around = median(ring);
    SpotLight light;
    for (const float value : disc) {
        light.sum += value - around;
        light.brightest = std::max(light.brightest, double(value));
    }
    for (float& value : ring) value = static_cast<float>(std::abs(value - around));
    const double spread = 1.4826 * median(ring);
    const auto pixels = static_cast<double>(disc.size());
    // The median of the ring is uncertain as well, and is taken away from every pixel of the disc.
    light.sigma = spread * std::sqrt(pixels + 1.57 * pixels * pixels / static_cast<double>(ring.size()));
    return light;
}

}  // namespace

std::vector<std::optional<LampSpot>> lamp_spots(const std::vector<BallLook>& shining,
                                                const std::vector<BallLook>& brief, const Ball& ball) {
    std::vector<cv::Mat3f> frames;
    for (const BallLook& look : shining) {
        cv::Mat3f& frame = frames.emplace_back();
        cv::merge(std::vector<cv::Mat>{look.light, look.light, look.light}, frame);
    }
    const auto readings = find_highlights(frames, ball);
    std::vector<std::optional<LampSpot>> spots(shining.size());
    for (std::size_t i = 0; i < shining.size(); ++i) {
        if (!readings[i].highlight) continue;
        const cv::Point2d at(readings[i].highlight->u, readings[i].highlight->v);
        const SpotLight light = light_at(brief[i].light, at, spot_radius(ball));
        spots[i] = {at, light.sum / brief[i].exposure_s, light.brightest >= clipping_level};
    }
    return spots;
}

std::vector<Leak> find_leaks(const std::vector<BallLook>& shining, const BallLook& dark,
                             const std::vector<std::optional<LampSpot>>& spots, const Ball& ball, double least_share) {
    std::vector<Leak> leaks;
    const double radius = spot_radius(ball);
    const auto look_at = [&](const BallLook& look, std::optional<std::size_t> commanded) {
        for (std::size_t j = 0; j < spots.size(); ++j) {
            if (!spots[j] || j == commanded || !(spots[j]->strength > 0)) continue;
            if (commanded && spots[*commanded] && cv::norm(spots[*commanded]->at - spots[j]->at) < 3 * radius) continue;
            const SpotLight light = light_at(look.light, spots[j]->at, radius);
            const double full = spots[j]->strength * look.exposure_s;
            if (light.sum > sure_of_light * light.sigma && light.sum > least_share * full)
                leaks.push_back({commanded, j, light.sum / full, light.sigma / full});
        }
    };
    for (std::size_t i = 0; i < shining.size(); ++i) look_at(shining[i], i);
    look_at(dark, std::nullopt);
    return leaks;
}

}  // namespace darkbox
