#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "processing/formats/bytes.h"
#include "processing/formats/exr.h"

namespace darkbox {

/// Keeps the library from reserving memory for sizes that no picture has. Before anything is read.
void limit_exr_library();

/// Every channel of the first part, as float. Throws InputError that names the file.
std::vector<ExrChannel> decode_exr(Bytes bytes, const std::string& file, std::uint64_t most_pixels);

/// R, G, B, or Y replicated. Throws InputError when there are neither.
cv::Mat3f colour_of(const std::vector<ExrChannel>& channels, const std::string& file);

}  // namespace darkbox
