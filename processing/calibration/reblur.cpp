#include "processing/calibration/reblur.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace darkbox {
namespace {

constexpr double again_px = 1.0;         ///< the second blur
constexpr double strong_share = 0.3;     ///< of the strongest slope: edges from here on are looked at
constexpr double sharpest_share = 0.15;  ///< of those edges
constexpr double slopes_of_noise = 8.0;  ///< an edge is this much steeper than noise

cv::Mat1f slopes(const cv::Mat1f& picture) {
    cv::Mat1f dx, dy, result;
    const cv::Mat1f kernel = (cv::Mat1f(1, 3) << -0.5F, 0, 0.5F);
    cv::filter2D(picture, dx, CV_32F, kernel);
    cv::filter2D(picture, dy, CV_32F, kernel.t());
    cv::magnitude(dx, dy, result);
    return result;
}

float quantile(std::vector<float>& values, double share) {
    const auto place = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), place, values.end());
    return *place;
}

bool is_crest(const cv::Mat1f& slope, int v, int u) {
    const float here = slope(v, u);
    return (here >= slope(v, u - 1) && here >= slope(v, u + 1)) || (here >= slope(v - 1, u) && here >= slope(v + 1, u));
}

}  // namespace

std::optional<double> edge_width_px(const cv::Mat1f& picture, const cv::Mat1b& mask, std::size_t fewest_edges) {
    cv::Mat1f softer;
    cv::GaussianBlur(picture, softer, {}, again_px);
    const cv::Mat1f slope = slopes(picture), soft_slope = slopes(softer);
    cv::Mat1b inside;  // not the mask's own border
    cv::erode(mask, inside, cv::Mat(), {-1, -1}, 5, cv::BORDER_CONSTANT, cv::Scalar(0));
    std::vector<float> all;
    for (int v = 1; v + 1 < slope.rows; ++v)
        for (int u = 1; u + 1 < slope.cols; ++u)
            if (inside(v, u)) all.push_back(slope(v, u));
    if (all.size() < fewest_edges) return std::nullopt;
    const float strongest = quantile(all, 0.999), usual = quantile(all, 0.5);
    const double least = std::max(strong_share * strongest, std::min(slopes_of_noise * usual, 0.8 * strongest));
    std::vector<float> blurs;
    for (int v = 1; v + 1 < slope.rows; ++v)
        for (int u = 1; u + 1 < slope.cols; ++u) {
            if (!inside(v, u) || slope(v, u) < least || !is_crest(slope, v, u)) continue;
            const double ratio = slope(v, u) / soft_slope(v, u);
            if (ratio > 1) blurs.push_back(static_cast<float>(again_px / std::sqrt(ratio * ratio - 1)));
        }
    if (blurs.size() < fewest_edges) return std::nullopt;
    return quantile(blurs, sharpest_share);
}

}  // namespace darkbox
