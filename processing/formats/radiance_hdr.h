#pragma once

#include <opencv2/core.hpp>
#include <string>

#include "processing/formats/bytes.h"

namespace darkbox {

/// Radiance RGBE (.hdr), flat or run-length encoded, rows from the top (-Y H +X W): linear R, G, B (Ward 1991, "Real
/// pixels", Graphics Gems II). Throws InputError that names the file when it is another kind, damaged or cut short.
cv::Mat3f decode_radiance_hdr(Bytes bytes, const std::string& file);

}  // namespace darkbox
