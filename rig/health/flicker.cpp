#include "rig/health/flicker.h"

#include <algorithm>
#include <cmath>

namespace darkbox {
namespace {

constexpr float darkest = 0.02F;
constexpr float brightest = 0.9F;  ///< far enough from clipping for the noise

}  // namespace

void FlickerMeter::add(const Luminance& picture) {
    if (used_.empty()) used_ = (picture.light > darkest) & (picture.light < brightest) & (picture.clipped == 0);
    const int count = cv::countNonZero(used_);
    if (count < 2) return;
    means_.push_back(cv::mean(picture.light, used_)[0]);
    if (!before_.empty()) {
        cv::Scalar mean, deviation;
        cv::meanStdDev(picture.light - before_, mean, deviation, used_);
        noise_sum_ += deviation[0] * deviation[0] / 2 / count;
    }
    picture.light.copyTo(before_);
}

std::optional<Flicker> FlickerMeter::result() const {
    if (means_.size() < 3) return std::nullopt;
    const auto count = static_cast<double>(means_.size());
    double mean = 0, variance = 0;
    for (const double m : means_) mean += m / count;
    for (const double m : means_) variance += (m - mean) * (m - mean) / (count - 1);
    const double noise = noise_sum_ / (count - 1);
    return Flicker{std::sqrt(std::max(0.0, variance - noise)) / mean, std::sqrt(noise) / mean, means_.size()};
}

}  // namespace darkbox
