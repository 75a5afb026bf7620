#pragma once

#include <cstddef>
#include <opencv2/core.hpp>
#include <span>
#include <string>
#include <string_view>

namespace darkbox {

/// Text as it may stand in HTML, in attributes too.
std::string escaped(std::string_view text);

std::string base64(std::span<const std::byte> bytes);

/// A picture inside the page: "data:image/png;base64,...". Photographs are JPEG when that is much smaller.
std::string data_uri(const cv::Mat3b& image);

}  // namespace darkbox
