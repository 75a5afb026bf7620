#include "processing/calibration/glint.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace darkbox {
namespace {

constexpr double max_glint_share = 0.04;  ///< of the zone's pixels
constexpr double small_glint_px = 12;     ///< a spot of this size is compact in a ball of any size
constexpr double least_contrast = 3;
constexpr double least_radiance = 0.02;
constexpr double least_movement = 0.02;  ///< in radii

struct Glint {
    double value = 0;
    cv::Point at;
};

std::optional<Glint> find_glint(const cv::Mat1f& image, const Circle& circle) {
    const double reach = mirror_zone * circle.radius;
    std::vector<float> values;
    Glint glint;
    const int top = std::max(0, static_cast<int>(std::ceil(circle.y - reach)));
    const int bottom = std::min(image.rows - 1, static_cast<int>(std::floor(circle.y + reach)));
    for (int y = top; y <= bottom; ++y) {
        const double half = std::sqrt(std::max(0.0, reach * reach - (y - circle.y) * (y - circle.y)));
        const int left = std::max(0, static_cast<int>(std::ceil(circle.x - half)));
        const int right = std::min(image.cols - 1, static_cast<int>(std::floor(circle.x + half)));
        for (int x = left; x <= right; ++x) {
            values.push_back(image(y, x));
            if (image(y, x) > glint.value) glint = {image(y, x), {x, y}};
        }
    }
    if (values.empty()) return std::nullopt;
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    const double background = *middle;
    if (!(glint.value > least_contrast * background + least_radiance)) return std::nullopt;
    const double half_height = (glint.value + background) / 2;
    const auto area = std::count_if(values.begin(), values.end(), [&](float v) { return v > half_height; });
    const double limit = std::max(small_glint_px, max_glint_share * static_cast<double>(values.size()));
    if (static_cast<double>(area) > limit) return std::nullopt;
    return glint;
}

/// Median over the images, pixel by pixel.
cv::Mat1f usual_light(const std::vector<cv::Mat1f>& images) {
    cv::Mat1f usual(images.front().size());
    std::vector<float> values(images.size());
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    for (int y = 0; y < usual.rows; ++y)
        for (int x = 0; x < usual.cols; ++x) {
            for (std::size_t i = 0; i < images.size(); ++i) values[i] = images[i](y, x);
            std::nth_element(values.begin(), middle, values.end());
            usual(y, x) = *middle;
        }
    return usual;
}

}  // namespace

std::vector<std::optional<cv::Point2d>> find_glints(const std::vector<cv::Mat1f>& images, const Circle& circle) {
    std::vector<std::optional<cv::Point2d>> glints;
    for (const cv::Mat1f& image : images) {
        glints.emplace_back();
        if (const auto spot = find_glint(image, circle))
            glints.back() = (cv::Point2d(spot->at) - cv::Point2d(circle.x, circle.y)) / circle.radius;
    }
    return glints;
}

double glint_share(const std::vector<std::optional<cv::Point2d>>& glints) {
    const std::optional<cv::Point2d>* first = nullptr;
    double movement = 0;
    int count = 0;
    for (const auto& glint : glints) {
        if (!glint) continue;
        ++count;
        if (!first) first = &glint;
        movement = std::max(movement, cv::norm(*glint - **first));
    }
    if (glints.size() > 1 && movement < least_movement) return 0;
    return static_cast<double>(count) / static_cast<double>(glints.size());
}

std::vector<cv::Mat1b> flashes(const std::vector<cv::Mat1f>& images) {
    const cv::Mat1f limit(least_contrast *
                              (images.size() < 3 ? cv::Mat1f(images.front().size(), 0.0F) : usual_light(images)) +
                          least_radiance);
    std::vector<cv::Mat1b> masks;
    for (const cv::Mat1f& image : images) masks.emplace_back(image > limit);
    return masks;
}

}  // namespace darkbox
