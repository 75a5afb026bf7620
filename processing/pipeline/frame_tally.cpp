#include "processing/pipeline/frame_tally.h"

#include <fmt/format.h>

#include <algorithm>

namespace darkbox {
namespace {

constexpr double black_share = 0.01;          // of the typical photograph's brightness: noise, no lamp
constexpr double clipped_object_share = 0.5;  // of the object
constexpr double overexposed_share = 0.01;
constexpr int fewest_samples = 3;

/// Pixels of the object that fewer used lights than a normal needs leave unclipped.
std::size_t overexposed_pixels(const PhotoStack& stack, const Lights& lights) {
    cv::Mat1w told(stack.mask.size(), ushort{0});
    cv::Mat1b any(stack.mask.size(), uchar{0});
    for (std::size_t i = 0; i < stack.clipped.size(); ++i) {
        if (!lights[i].used) continue;
        cv::add(told, 1, told, stack.clipped[i] == 0);
        any |= stack.clipped[i];
    }
    return static_cast<std::size_t>(cv::countNonZero((told < fewest_samples) & any & stack.mask));
}

}  // namespace

void FrameTally::add(const PhotoStack& stack, const Lights& lights) {
    overexposed_ += overexposed_pixels(stack, lights);
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

std::vector<std::size_t> FrameTally::black(const Lights& lights) const {
    std::vector<std::size_t> black;
    if (frames_.empty() || pixels_ == 0) return black;
    const double typical = typical_radiance();
    for (std::size_t i = 0; i < frames_.size(); ++i)
        if (lights[i].used && frames_[i].radiance < black_share * typical) black.push_back(i);
    return black;
}

std::vector<std::string> FrameTally::warnings(const Lights& lights) const {
    std::vector<std::string> warnings;
    if (pixels_ == 0) return warnings;
    const auto all = static_cast<double>(pixels_);
    for (std::size_t i = 0; i < frames_.size(); ++i) {
        const double clipped = static_cast<double>(frames_[i].clipped) / all;
        if (lights[i].used && clipped > clipped_object_share)
            warnings.push_back(
                fmt::format("{0} is clipped on {1:.0f} % of the object: expose less, or leave it out "
                            "with: darkbox calibrate SESSION --drop {0}",
                            frames_[i].file, 100 * clipped));
    }
    if (const double lost = static_cast<double>(overexposed_) / all; lost > overexposed_share)
        warnings.push_back(
            fmt::format("{:.0f} % of the object is clipped in so many photographs that the others do not tell its "
                        "normal, and is left out: expose less",
                        100 * lost));
    return warnings;
}

}  // namespace darkbox
