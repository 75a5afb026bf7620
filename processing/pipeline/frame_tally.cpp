#include "processing/pipeline/frame_tally.h"

#include <fmt/format.h>

#include <algorithm>

namespace darkbox {
namespace {

constexpr double black_share = 0.01;   // of the typical photograph's brightness: noise, no lamp
constexpr double clipped_share = 0.5;  // of the object

}  // namespace

void FrameTally::add(const PhotoStack& stack) {
    frames_.resize(stack.images.size());
    pixels_ += static_cast<std::size_t>(cv::countNonZero(stack.mask));
    cv::Mat1b clipped;
    for (std::size_t i = 0; i < stack.images.size(); ++i) {
        Frame& frame = frames_[i];
        frame.file = stack.files[i];
        const cv::Scalar mean = cv::mean(stack.images[i], stack.mask);
        frame.radiance += (mean[0] + mean[1] + mean[2]) / 3 * cv::countNonZero(stack.mask);
        cv::bitwise_and(stack.clipped[i], stack.mask, clipped);
        frame.clipped += static_cast<std::size_t>(cv::countNonZero(clipped));
    }
}

double FrameTally::typical_radiance() const {
    std::vector<double> all;
    for (const Frame& frame : frames_) all.push_back(frame.radiance);
    const auto middle = all.begin() + static_cast<std::ptrdiff_t>(all.size() / 2);
    std::nth_element(all.begin(), middle, all.end());
    return *middle;
}

std::vector<std::string> FrameTally::warnings(const Lights& lights) const {
    std::vector<std::string> warnings;
    if (frames_.empty() || pixels_ == 0) return warnings;
    const double typical = typical_radiance();
    for (std::size_t i = 0; i < frames_.size() && i < lights.size(); ++i) {
        const Frame& frame = frames_[i];
        const double clipped = static_cast<double>(frame.clipped) / static_cast<double>(pixels_);
        if (!lights[i].used) continue;
        if (frame.radiance < black_share * typical)
            warnings.push_back(
                fmt::format("{0} is black wherever the object is: was its lamp on? Take it again, or "
                            "leave it out with: darkbox calibrate SESSION --drop {0}",
                            frame.file));
        else if (clipped > clipped_share)
            warnings.push_back(
                fmt::format("{0} is clipped on {1:.0f} % of the object: expose less, or leave it out "
                            "with: darkbox calibrate SESSION --drop {0}",
                            frame.file, 100 * clipped));
    }
    return warnings;
}

}  // namespace darkbox
