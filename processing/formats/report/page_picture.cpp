#include "processing/formats/report/page_picture.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>

namespace darkbox {

cv::Mat3b for_page(const cv::Mat3b& picture) {
    const int side = std::max(picture.cols, picture.rows);
    if (side <= page_side) return picture;
    const double scale = static_cast<double>(page_side) / side;
    cv::Mat3b small;
    cv::resize(picture, small, {std::max(1, cvRound(scale * picture.cols)), std::max(1, cvRound(scale * picture.rows))},
               0, 0, cv::INTER_AREA);
    return small;
}

}  // namespace darkbox
