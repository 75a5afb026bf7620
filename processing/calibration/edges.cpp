#include "processing/calibration/edges.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace darkbox {
namespace {

constexpr double blur_px = 1.2;
constexpr double quiet_share = 0.25;     ///< of the picture that shows noise alone
constexpr float edge_in_quiet = 6;       ///< gradients of an edge over that share's: 4.5 standard deviations
constexpr float least_gradient = 0.01F;  ///< per pixel, of the compressed picture; below it there is only rounding

float threshold_for(const cv::Mat1f& magnitude) {
    std::vector<float> all(magnitude.begin(), magnitude.end());
    const auto at = all.begin() + static_cast<std::ptrdiff_t>(static_cast<double>(all.size()) * quiet_share);
    std::nth_element(all.begin(), at, all.end());
    return std::max(edge_in_quiet * *at, least_gradient);
}

}  // namespace

std::vector<Edge> find_edges(const cv::Mat1f& image) {
    cv::Mat1f smooth, gx, gy, magnitude;
    cv::GaussianBlur(image, smooth, {}, blur_px);
    cv::Scharr(smooth, gx, CV_32F, 1, 0, 1.0 / 32);
    cv::Scharr(smooth, gy, CV_32F, 0, 1, 1.0 / 32);
    cv::magnitude(gx, gy, magnitude);
    const float threshold = threshold_for(magnitude);

    std::vector<Edge> edges;
    for (int y = 1; y + 1 < image.rows; ++y)
        for (int x = 1; x + 1 < image.cols; ++x) {
            const float m = magnitude(y, x);
            if (!(m >= threshold)) continue;
            const cv::Point2d across(gx(y, x) / m, gy(y, x) / m);
            const int dx = static_cast<int>(std::lround(across.x)), dy = static_cast<int>(std::lround(across.y));
            if (m >= magnitude(y + dy, x + dx) && m > magnitude(y - dy, x - dx))
                edges.push_back({{1.0 * x, 1.0 * y}, across});
        }
    return edges;
}

}  // namespace darkbox
