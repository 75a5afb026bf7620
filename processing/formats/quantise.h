#pragma once

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

namespace darkbox {

/// A channel's values as bytes: value = (byte - bias) scale, both rounded as a file needs them.
struct ByteRange {
    double scale = 1;
    double bias = 0;

    unsigned char byte(double value) const {
        return static_cast<unsigned char>(std::clamp(std::round(value / scale + bias), 0.0, 255.0));
    }
};

struct ValueRange {
    double low = 0, high = 0;
};

/// Over all pixels and channels; black outside the object is a value too.
inline ValueRange range_of(const cv::Mat& values) {
    ValueRange range;
    cv::minMaxLoc(values.reshape(1), &range.low, &range.high);
    return range;
}

}  // namespace darkbox
