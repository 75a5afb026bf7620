#pragma once

#include <optional>

#include "processing/formats/bytes.h"
#include "processing/formats/picture.h"

namespace darkbox {

/// The curve of an ICC profile (ICC.1:2010, 10.5 and 10.15), told by its red or grey tone curve: linear when that is
/// the identity, else made for looking at. No value for profiles without such a curve, or damaged ones: they are hints,
/// not content.
std::optional<EmbeddedCurve> curve_of_icc_profile(Bytes profile);

}  // namespace darkbox
