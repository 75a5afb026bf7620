#include "processing/calibration/outline.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "processing/maps/maps.h"

namespace darkbox {
namespace {

constexpr double floor_radiance = 1.0 / 255;

}  // namespace

cv::Mat1f mean_over_frames(const std::vector<cv::Mat3f>& frames) {
    cv::Mat1d sum(frames.front().size(), 0.0);
    for (const cv::Mat3f& frame : frames) cv::accumulate(mean_channel(frame), sum);
    cv::Mat1f mean;
    sum.convertTo(mean, CV_32F, 1.0 / static_cast<double>(frames.size()));
    return mean;
}

ReducedFrames reduce(const std::vector<cv::Mat3f>& frames, int max_side) {
    ReducedFrames reduced;
    const cv::Size size = frames.front().size();
    reduced.scale = std::max(1.0, static_cast<double>(std::max(size.width, size.height)) / max_side);
    const cv::Size small(std::max(1, cvRound(size.width / reduced.scale)),
                         std::max(1, cvRound(size.height / reduced.scale)));
    for (const cv::Mat3f& frame : frames) {
        cv::Mat1f image = mean_channel(frame);
        if (small != size) cv::resize(image, image, small, 0, 0, cv::INTER_AREA);
        reduced.images.push_back(image);
    }
    return reduced;
}

cv::Mat1f compress(const cv::Mat1f& radiance) {
    cv::Mat1f compressed;
    cv::max(radiance, 0.0F, compressed);
    compressed += floor_radiance;
    cv::log(compressed, compressed);
    return compressed;
}

}  // namespace darkbox
