#pragma once

#include <opencv2/core.hpp>

namespace darkbox {

inline constexpr int page_side = 1600;  ///< px: more of a picture no page shows

/// The picture, averaged down where its longer side exceeds page_side.
cv::Mat3b for_page(const cv::Mat3b& picture);

}  // namespace darkbox
