#include "processing/pipeline/transfer_check.h"

#include <fmt/format.h>

#include "processing/normals/photometric_stereo.h"
#include "processing/pipeline/radiance.h"

namespace darkbox {
namespace {

constexpr double clearly_better = 0.75;
constexpr double least_residual = 1e-3;  // of the mean radiance: below it either curve fits, or too few samples do

double mean_radiance(const std::vector<PhotoRows>& photos, const cv::Mat1b& mask) {
    double sum = 0;
    for (const PhotoRows& photo : photos) {
        const cv::Scalar mean = cv::mean(radiance_of(photo), mask);
        sum += (mean[0] + mean[1] + mean[2]) / 3.0;
    }
    return sum / static_cast<double>(photos.size());
}

/// The same samples as if the other curve had been chosen at import.
std::vector<PhotoRows> under_other_curve(std::vector<PhotoRows> photos, TransferCurve curve) {
    const auto other = curve == TransferCurve::srgb ? nullptr : srgb_curve(255);
    for (PhotoRows& photo : photos) photo.curve = other;
    return photos;
}

/// Some rows do not tell where in the picture they lie. What near lamps then leave unexplained is in both residuals.
Lights as_distant(Lights lights) {
    for (Light& light : lights) light.near.reset();
    return lights;
}

/// The residual as a share of the mean radiance.
double relative_residual(const std::vector<PhotoRows>& photos, const cv::Mat1b& mask, const Lights& lights,
                         const WorkContext& work) {
    PhotosInMemory source(photos, {}, mask);
    WorkContext silent = work;
    silent.report = nullptr;
    return photometric_stereo(source, as_distant(lights), {}, silent).residual_rms / mean_radiance(photos, mask);
}

}  // namespace

std::optional<std::string> transfer_warning(const std::vector<PhotoRows>& photos, const cv::Mat1b& mask,
                                            const Lights& lights, TransferCurve curve, const WorkContext& work) {
    const double chosen = relative_residual(photos, mask, lights, work);
    const double instead = relative_residual(under_other_curve(photos, curve), mask, lights, work);
    if (!(chosen > least_residual && instead < clearly_better * chosen)) return std::nullopt;
    const bool srgb = curve == TransferCurve::srgb;
    return fmt::format(
        "the photographs were read as {0}, but fit Lambert's law better as {1} (residual {2:.1f} % of the "
        "mean radiance instead of {3:.1f} %): import again with --transfer {1} if the camera's values are {1}",
        srgb ? "srgb" : "linear", srgb ? "linear" : "srgb", instead * 100, chosen * 100);
}

}  // namespace darkbox
