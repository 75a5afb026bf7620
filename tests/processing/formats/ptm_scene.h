#pragma once

#include <opencv2/core.hpp>

#include "processing/relight/ptm.h"

namespace darkbox::test {

/// A texture map whose corners differ, so that flips and swaps show.
inline Ptm some_ptm(PtmModel model) {
    Ptm ptm;
    ptm.model = model;
    constexpr int width = 24, height = 16;
    for (int t = 0; t < ptm_terms; ++t) {
        cv::Mat values(height, width, model == PtmModel::rgb ? CV_32FC3 : CV_32FC1);
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x)
                for (int c = 0; c < values.channels(); ++c)
                    values.ptr<float>(y)[x * values.channels() + c] = static_cast<float>(
                        t == 5 ? 0.3 + 0.01 * x + 0.02 * y : (0.1 * t - 0.2) * (0.5 + 0.02 * y - 0.01 * x * (c + 1)));
        ptm.coefficient[static_cast<std::size_t>(t)] = values;
    }
    if (model == PtmModel::rgb) return ptm;
    ptm.colour = cv::Mat3f(height, width);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            ptm.colour(y, x) = {1.0F, 0.2F + 0.04F * static_cast<float>(y), 0.9F - 0.03F * static_cast<float>(x)};
    return ptm;
}

}  // namespace darkbox::test
