#include "processing/pipeline/false_colour.h"

#include <algorithm>
#include <cmath>

namespace darkbox {
namespace {

constexpr double golden_turn = 0.61803398874989485;  // neighbouring labels get hues far apart

uchar channel(double hue, double offset, double value) {
    const double t = std::abs(std::fmod(hue + offset, 1.0) * 6.0 - 3.0) - 1.0;
    return cv::saturate_cast<uchar>(255.0 * value * (0.25 + 0.75 * std::clamp(t, 0.0, 1.0)));
}

cv::Vec3b colour_of(int label) {
    const double hue = std::fmod(label * golden_turn, 1.0);
    const double value = 0.6 + 0.4 * (label % 3) / 2.0;
    return {channel(hue, 0.0, value), channel(hue, 2.0 / 3.0, value), channel(hue, 1.0 / 3.0, value)};
}

}  // namespace

cv::Mat3b false_colours(const IndexMap& index) {
    cv::Mat3b image(index.label.size(), cv::Vec3b(0, 0, 0));
    for (int y = 0; y < image.rows; ++y)
        for (int x = 0; x < image.cols; ++x)
            if (index.label(y, x)) image(y, x) = colour_of(index.label(y, x));
    return image;
}

cv::Mat3b heat(const cv::Mat1f& values, const cv::Mat1b& mask, double top) {
    cv::Mat3b image(values.size(), cv::Vec3b(0, 0, 0));
    for (int y = 0; y < image.rows; ++y)
        for (int x = 0; x < image.cols; ++x) {
            if (!mask(y, x)) continue;
            const double t = std::clamp(values(y, x) / top, 0.0, 1.0) * 3.0;
            for (int c = 0; c < 3; ++c) image(y, x)[c] = cv::saturate_cast<uchar>(255.0 * std::clamp(t - c, 0.0, 1.0));
        }
    return image;
}

cv::Mat3b normal_colours(const NormalMap& normals) {
    cv::Mat3b image(normals.normal.size(), cv::Vec3b(0, 0, 0));
    for (int y = 0; y < image.rows; ++y)
        for (int x = 0; x < image.cols; ++x) {
            if (!normals.valid(y, x)) continue;
            for (int c = 0; c < 3; ++c)
                image(y, x)[c] = cv::saturate_cast<uchar>((normals.normal(y, x)[c] + 1.0F) * 127.5F);
        }
    return image;
}

}  // namespace darkbox
