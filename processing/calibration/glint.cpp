#include "processing/calibration/glint.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace darkbox {
namespace {

constexpr double max_share_of_zone = 0.04;
constexpr double max_small_area_px = 12;  ///< a spot of this size is compact in a ball of any size
constexpr double least_contrast = 3;
constexpr double least_radiance = 0.02;
constexpr double least_movement = 0.02;  ///< of the radius

struct Spot {
    double value = 0;
    cv::Point at;
};

std::optional<Spot> find_glint(const cv::Mat1f& image, const Circle& circle) {
    const double reach = mirror_zone * circle.radius;
    std::vector<float> values;
    Spot spot;
    const int top = std::max(0, static_cast<int>(std::ceil(circle.y - reach)));
    const int bottom = std::min(image.rows - 1, static_cast<int>(std::floor(circle.y + reach)));
    for (int y = top; y <= bottom; ++y) {
        const double half = std::sqrt(std::max(0.0, reach * reach - (y - circle.y) * (y - circle.y)));
        const int left = std::max(0, static_cast<int>(std::ceil(circle.x - half)));
        const int right = std::min(image.cols - 1, static_cast<int>(std::floor(circle.x + half)));
        for (int x = left; x <= right; ++x) {
            values.push_back(image(y, x));
            if (image(y, x) > spot.value) spot = {image(y, x), {x, y}};
        }
    }
    if (values.empty()) return std::nullopt;
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    const double background = *middle;
    if (!(spot.value > least_contrast * background + least_radiance)) return std::nullopt;
    const double half_height = (spot.value + background) / 2;
    const auto area = std::count_if(values.begin(), values.end(), [&](float v) { return v > half_height; });
    const double limit = std::max(max_small_area_px, max_share_of_zone * static_cast<double>(values.size()));
    if (static_cast<double>(area) > limit) return std::nullopt;
    return spot;
}

}  // namespace

double glint_share(const std::vector<cv::Mat1f>& images, const Circle& circle) {
    std::vector<cv::Point2d> spots;
    for (const cv::Mat1f& image : images)
        if (const auto spot = find_glint(image, circle)) spots.emplace_back(spot->at);
    if (spots.empty()) return 0;
    double movement = 0;
    for (const auto& spot : spots) movement = std::max(movement, cv::norm(spot - spots.front()));
    if (images.size() > 1 && movement < least_movement * circle.radius) return 0;
    return static_cast<double>(spots.size()) / static_cast<double>(images.size());
}

}  // namespace darkbox
