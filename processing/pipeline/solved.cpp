#include "processing/pipeline/solved.h"

#include <fmt/format.h>

#include "acquisition/frame/error.h"

namespace darkbox {
namespace {

constexpr double mostly = 0.5;

/// Of the samples on the object.
double clipped_share(const PhotoStack& stack) {
    double clipped = 0;
    for (const cv::Mat1b& frame : stack.clipped) clipped += cv::countNonZero(frame & stack.mask);
    const double samples = static_cast<double>(stack.clipped.size()) * cv::countNonZero(stack.mask);
    return samples > 0 ? clipped / samples : 0;
}

}  // namespace

void require_any_normal(const PhotometricStereoResult& solved, const PhotoStack& stack) {
    if (solved.pixels > 0) return;
    if (const double share = clipped_share(stack); share > mostly)
        throw InputError(
            fmt::format("{:.0f} % of the object's samples are clipped: no pixel is left that tells its normal",
                        100 * share),
            "take the photographs again with a shorter exposure");
    throw InputError("no pixel of the object is bright enough in the photographs to tell its normal",
                     "check that the mask is white on the object, and that the photographs show it lit");
}

}  // namespace darkbox
