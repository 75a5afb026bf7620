#pragma once

#include <opencv2/core.hpp>
#include <optional>

#include "processing/transfer/appearance.h"

namespace darkbox {

// What can be told of a source coordinate for each target pixel; see TransferMeasures. Each is over the target's valid
// pixels whose coordinates are valid in the source, or pairs of them; std::nullopt where there is none.

std::optional<double> seam(const Appearance& source, const cv::Mat1b& target, const cv::Mat2i& coordinates);

struct AngleMeasure {
    double mean_deg = 0;
    double p95_deg = 0;
};

std::optional<AngleMeasure> angles(const NormalMap& source, const NormalMap& target, const cv::Mat2i& coordinates);

/// Share of the source's valid pixels that are used.
double cover(const cv::Mat1b& source, const cv::Mat1b& target, const cv::Mat2i& coordinates);

/// Target pixels whose source pixel is not valid.
int background(const cv::Mat1b& source, const cv::Mat1b& target, const cv::Mat2i& coordinates);

/// The 95th percentile over target normals of the angle to the nearest of the source's, degrees; on a sample.
double coverage_deg(const NormalMap& source, const NormalMap& target);

/// Of all pairs of valid target pixels side by side or one above the other, the share whose source coordinates lie so
/// too. 1 where there is no pair. Pixels of negative coordinates are outside.
double coherence(const cv::Mat2i& coordinates);

}  // namespace darkbox
