#pragma once

#include <cstddef>
#include <cstdint>
#include <opencv2/core.hpp>

namespace darkbox {

struct PairedBootstrapOptions {
    int block_px = 32;           ///< side of the square blocks; well above the distance over which errors are alike
    int resamples = 10000;       ///< drawn with replacement, as many blocks each as there are
    double confidence = 0.95;    ///< of the interval, two-sided
    std::uint64_t seed = 20061;  ///< the same seed gives the same interval

    /// Throws InputError that names the field and the allowed range.
    void validate() const;
};

struct PairedBootstrap {
    double mean_difference = 0;  ///< of `second` less `first`: below 0 where the second is smaller
    double low = 0;              ///< interval of the mean difference
    double high = 0;
    std::size_t pixels = 0;
    std::size_t blocks = 0;  ///< that hold any of them
};

/// The mean difference of two maps of errors over the pixels where both are numbers (NaN = not known), and a percentile
/// interval of it by a block bootstrap: neighbouring pixels share noise, shadows and calibration errors, so that whole
/// blocks are drawn, not pixels (Efron and Tibshirani 1993, An Introduction to the Bootstrap, sections 8.6 and 13.3).
/// Throws InputError when the sizes differ or fewer than two blocks hold pixels.
PairedBootstrap paired_bootstrap(const cv::Mat1d& first, const cv::Mat1d& second,
                                 const PairedBootstrapOptions& options = {});

}  // namespace darkbox
