#pragma once

#include <cstddef>
#include <opencv2/core.hpp>
#include <vector>

#include "acquisition/frame/progress.h"
#include "acquisition/session/session.h"

namespace darkbox {

/// What the lit photographs show together, for looking at.
struct PhotographsSeen {
    std::size_t photographs = 0;
    cv::Mat3f mean;                ///< linear radiance
    cv::Mat3f brightest;           ///< each channel's greatest value
    cv::Mat1b mask;                ///< 255 on the object
    std::vector<double> exposure;  ///< shares of samples on the object, equal bins over 0...1: the brightest channel
};

/// Few rows of the photographs are in memory at a time. Where the session has no mask they are read twice, since
/// finding it needs all of them. Throws InputError as load_stack() does.
PhotographsSeen see_photographs(const Session& session, std::size_t bins, const WorkContext& work);

/// Each channel's greatest value over the session's frames of the ball, a capture of its own.
cv::Mat3f brightest_of_ball(const Session& session, const WorkContext& work);

}  // namespace darkbox
