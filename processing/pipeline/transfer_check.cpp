#include "processing/pipeline/transfer_check.h"

#include <fmt/format.h>

#include "processing/formats/srgb.h"
#include "processing/normals/photometric_stereo.h"

namespace darkbox {
namespace {

constexpr double clearly_better = 0.75;
constexpr double least_residual = 1e-3;  // of the mean radiance: below it either curve fits, or too few samples do

double mean_radiance(const PhotoStack& stack) {
    double sum = 0;
    for (const cv::Mat3f& image : stack.images) {
        const cv::Scalar mean = cv::mean(image, stack.mask);
        sum += (mean[0] + mean[1] + mean[2]) / 3.0;
    }
    return sum / static_cast<double>(stack.images.size());
}

cv::Mat3f encoded(const cv::Mat3f& linear) {
    cv::Mat3f srgb(linear.size());
    for (int y = 0; y < linear.rows; ++y)
        for (int x = 0; x < linear.cols; ++x)
            for (int c = 0; c < 3; ++c) srgb(y, x)[c] = srgb_from_linear(linear(y, x)[c]);
    return srgb;
}

/// The same samples as if the other curve had been chosen at import.
PhotoStack under_other_curve(const PhotoStack& stack, TransferCurve curve) {
    PhotoStack other = stack;
    for (cv::Mat3f& image : other.images)
        image = curve == TransferCurve::srgb ? encoded(image) : linear_from_srgb(image);
    return other;
}

}  // namespace

std::optional<std::string> transfer_warning(const PhotoStack& stack, const Lights& lights, TransferCurve curve,
                                            double residual_rms, const WorkContext& work) {
    const PhotoStack other = under_other_curve(stack, curve);
    const double chosen = residual_rms / mean_radiance(stack);
    const double instead = photometric_stereo(other, lights, {}, work).residual_rms / mean_radiance(other);
    if (!(chosen > least_residual && instead < clearly_better * chosen)) return std::nullopt;
    const bool srgb = curve == TransferCurve::srgb;
    return fmt::format(
        "the photographs were read as {0}, but fit Lambert's law better as {1} (residual {2:.1f} % of the "
        "mean radiance instead of {3:.1f} %): import again with --transfer {1} if the camera's values are {1}",
        srgb ? "srgb" : "linear", srgb ? "linear" : "srgb", instead * 100, chosen * 100);
}

}  // namespace darkbox
