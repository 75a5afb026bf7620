#include "rig/health/luminance.h"

#include <cmath>

#include "rig/capture/picture.h"

namespace darkbox {

Luminance luminance_of(const Frame& frame) {
    const Picture picture = to_picture(frame);
    const int side = mosaic(frame.format) ? 2 : 1;  // of a cell, in rows
    const int across = picture.columns / frame.width * side;
    const auto black = static_cast<float>(frame.black_level);
    const auto full = static_cast<float>(std::exp2(frame.bit_depth)) - 1.0F;
    const auto count = static_cast<float>(side * across);
    Luminance result{cv::Mat1f(frame.height / side, frame.width / side),
                     cv::Mat1b(frame.height / side, frame.width / side, uchar{0})};
    for (int v = 0; v < result.light.rows; ++v)
        for (int u = 0; u < result.light.cols; ++u) {
            float sum = 0;
            for (int row = v * side; row < (v + 1) * side; ++row)
                for (int column = u * across; column < (u + 1) * across; ++column) {
                    const float sample = picture.samples[static_cast<std::size_t>(row) * picture.columns + column];
                    sum += sample;
                    if (sample >= clipping_level * full) result.clipped(v, u) = 255;
                }
            result.light(v, u) = (sum / count - black) / (full - black);
        }
    return result;
}

}  // namespace darkbox
