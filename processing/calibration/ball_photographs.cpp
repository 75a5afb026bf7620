#include "processing/calibration/ball_photographs.h"

namespace darkbox {

BallOverview BallFramesInMemory::overview(int reduced_side) {
    BallOverview overview{mean_over_frames(frames_), {}};
    if (reduced_side > 0) overview.reduced = reduce(frames_, reduced_side);
    return overview;
}

std::vector<std::vector<cv::Mat3f>> BallFramesInMemory::parts(const std::vector<cv::Rect>& boxes) {
    std::vector<std::vector<cv::Mat3f>> parts(boxes.size());
    for (std::size_t b = 0; b < boxes.size(); ++b)
        for (const cv::Mat3f& frame : frames_) parts[b].push_back(frame(boxes[b]));
    return parts;
}

}  // namespace darkbox
