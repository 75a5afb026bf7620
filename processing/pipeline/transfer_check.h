#pragma once

#include <optional>
#include <string>
#include <vector>

#include "acquisition/frame/progress.h"
#include "acquisition/session/session.h"
#include "processing/maps/photo_source.h"

namespace darkbox {

/// A warning when the photographs, decoded with `curve`, fit Lambert's law clearly better under the other curve: the
/// least-squares residual as a share of the mean radiance falls by a quarter or more. `photos` are 8-bit and whole
/// pictures or some rows of them. Near lights count as distant ones.
std::optional<std::string> transfer_warning(const std::vector<PhotoRows>& photos, const cv::Mat1b& mask,
                                            const Lights& lights, TransferCurve curve, const WorkContext& work);

}  // namespace darkbox
