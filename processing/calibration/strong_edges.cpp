#include "processing/calibration/strong_edges.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>

namespace darkbox {
namespace {

constexpr double strong_share = 0.3;     ///< of the strongest slope: edges from here on are looked at
constexpr double sharpest_share = 0.15;  ///< of those edges
constexpr double slopes_of_noise = 8.0;  ///< an edge is this much steeper than noise

template <typename Number>
Number quantile(std::vector<Number>& values, double share) {
    const auto place = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), place, values.end());
    return *place;
}

bool is_crest(const cv::Mat1f& slope, cv::Point at) {
    const float here = slope(at);
    return (here >= slope(at.y, at.x - 1) && here >= slope(at.y, at.x + 1)) ||
           (here >= slope(at.y - 1, at.x) && here >= slope(at.y + 1, at.x));
}

/// Not the mask's own border, nor the picture's.
std::vector<cv::Point> pixels_inside(const cv::Mat1b& mask) {
    cv::Mat1b inside;
    cv::erode(mask, inside, cv::Mat(), {-1, -1}, 5, cv::BORDER_CONSTANT, cv::Scalar(0));
    std::vector<cv::Point> pixels;
    for (int v = 1; v + 1 < mask.rows; ++v)
        for (int u = 1; u + 1 < mask.cols; ++u)
            if (inside(v, u)) pixels.emplace_back(u, v);
    return pixels;
}

}  // namespace

Slopes slopes_of(const cv::Mat1f& picture) {
    Slopes slopes;
    const cv::Mat1f kernel = (cv::Mat1f(1, 3) << -0.5F, 0, 0.5F);
    cv::filter2D(picture, slopes.dx, CV_32F, kernel);
    cv::filter2D(picture, slopes.dy, CV_32F, kernel.t());
    cv::magnitude(slopes.dx, slopes.dy, slopes.size);
    return slopes;
}

std::vector<cv::Point> strong_edges(const Slopes& slopes, const cv::Mat1b& mask, std::size_t fewest_pixels) {
    const std::vector<cv::Point> pixels = pixels_inside(mask);
    if (pixels.empty() || pixels.size() < fewest_pixels) return {};
    std::vector<float> all;
    for (const cv::Point& at : pixels) all.push_back(slopes.size(at));
    const float strongest = quantile(all, 0.999), usual = quantile(all, 0.5);
    const double least = std::max(strong_share * strongest, std::min(slopes_of_noise * usual, 0.8 * strongest));
    std::vector<cv::Point> edges;
    for (const cv::Point& at : pixels)
        if (slopes.size(at) > 0 && slopes.size(at) >= least && is_crest(slopes.size, at)) edges.push_back(at);
    return edges;
}

double sharpest_of(std::vector<double>& blurs_px) { return quantile(blurs_px, sharpest_share); }

}  // namespace darkbox
