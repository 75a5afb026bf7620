#include "processing/calibration/reblur.h"

#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "processing/calibration/strong_edges.h"

namespace darkbox {

std::optional<double> edge_width_px(const cv::Mat1f& picture, const cv::Mat1b& mask, std::size_t fewest_edges) {
    constexpr double again_px = 1.0;  // the second blur
    cv::Mat1f softer;
    cv::GaussianBlur(picture, softer, {}, again_px);
    const Slopes slopes = slopes_of(picture), soft = slopes_of(softer);
    std::vector<double> blurs;
    for (const cv::Point& at : strong_edges(slopes, mask, fewest_edges)) {
        const double ratio = slopes.size(at) / soft.size(at);
        if (ratio > 1) blurs.push_back(again_px / std::sqrt(ratio * ratio - 1));
    }
    if (blurs.empty() || blurs.size() < fewest_edges) return std::nullopt;
    return sharpest_of(blurs);
}

}  // namespace darkbox
