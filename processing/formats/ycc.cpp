#include "processing/formats/ycc.h"

namespace darkbox {

cv::Mat3b rgb_of_ycc(const cv::Mat2b& ycc) {
    cv::Mat3b rgb(ycc.size());
    for (int row = 0; row < ycc.rows; ++row) {
        for (int column = 0; column < ycc.cols; ++column) {
            const int pair = column & ~1;
            const double luma = 255.0 / 219.0 * (ycc(row, column)[0] - 16);
            const double cb = (ycc(row, pair)[1] - 128) * (255.0 / 224.0);
            const double cr = (ycc(row, pair + 1)[1] - 128) * (255.0 / 224.0);
            // With Kr = 0.299, Kb = 0.114: R - Y = 2 (1 - Kr) Cr, B - Y = 2 (1 - Kb) Cb.
            rgb(row, column) = {cv::saturate_cast<uchar>(luma + 1.402 * cr),
                                cv::saturate_cast<uchar>(luma - (0.114 * 1.772 * cb + 0.299 * 1.402 * cr) / 0.587),
                                cv::saturate_cast<uchar>(luma + 1.772 * cb)};
        }
    }
    return rgb;
}

}  // namespace darkbox
