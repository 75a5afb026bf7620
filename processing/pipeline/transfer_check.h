#pragma once

#include <optional>
#include <string>

#include "acquisition/frame/progress.h"
#include "acquisition/session/session.h"
#include "processing/maps/maps.h"

namespace darkbox {

/// A warning when the photographs, decoded with `curve`, fit Lambert's law clearly better under the other curve: the
/// least-squares residual as a share of the mean radiance falls by a quarter or more. `residual_rms` is the stack's
/// own.
std::optional<std::string> transfer_warning(const PhotoStack& stack, const Lights& lights, TransferCurve curve,
                                            double residual_rms, const WorkContext& work);

}  // namespace darkbox
