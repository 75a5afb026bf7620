#include "processing/calibration/outline.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "processing/maps/maps.h"

namespace darkbox {
namespace {

constexpr double least_floor = 1.0 / 1024;
constexpr double floor_in_noise = 4;

/// Standard deviation of a pixel's noise, from the differences of neighbours, most of which see no edge.
double noise_of(const cv::Mat1f& image) {
    std::vector<float> differences;
    for (int y = 0; y < image.rows; ++y)
        for (int x = 1; x < image.cols; ++x) differences.push_back(std::abs(image(y, x) - image(y, x - 1)));
    if (differences.empty()) return 0;
    const auto middle = differences.begin() + static_cast<std::ptrdiff_t>(differences.size() / 2);
    std::nth_element(differences.begin(), middle, differences.end());
    return 1.4826 * *middle / std::sqrt(2.0);
}

}  // namespace

cv::Mat1f mean_over_frames(const std::vector<cv::Mat3f>& frames) {
    cv::Mat1d sum(frames.front().size(), 0.0);
    for (const cv::Mat3f& frame : frames) cv::accumulate(mean_channel(frame), sum);
    cv::Mat1f mean;
    sum.convertTo(mean, CV_32F, 1.0 / static_cast<double>(frames.size()));
    return mean;
}

Reduction::Reduction(cv::Size size, int max_side)
    : scale_(std::max(1.0, static_cast<double>(std::max(size.width, size.height)) / max_side)),
      small_(std::max(1, cvRound(size.width / scale_)), std::max(1, cvRound(size.height / scale_))) {}

cv::Mat1f Reduction::of(const cv::Mat1f& luminance) const {
    if (small_ == luminance.size()) return luminance;
    cv::Mat1f image;
    cv::resize(luminance, image, small_, 0, 0, cv::INTER_AREA);
    return image;
}

ReducedFrames reduce(const std::vector<cv::Mat3f>& frames, int max_side) {
    const Reduction reduction(frames.front().size(), max_side);
    ReducedFrames reduced;
    reduced.scale = reduction.scale();
    for (const cv::Mat3f& frame : frames) reduced.images.push_back(reduction.of(mean_channel(frame)));
    return reduced;
}

cv::Mat1f compress(const cv::Mat1f& radiance) {
    cv::Mat1f compressed;
    cv::max(radiance, 0.0F, compressed);
    compressed += std::max(least_floor, floor_in_noise * noise_of(radiance));
    cv::log(compressed, compressed);
    return compressed;
}

}  // namespace darkbox
