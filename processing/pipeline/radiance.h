#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "acquisition/frame/progress.h"
#include "acquisition/session/session.h"

namespace darkbox {

/// A frame as linear radiance, 1.0 = full scale after the black level.
struct Radiance {
    cv::Mat3f image;
    cv::Mat1b clipped;  ///< 255 where any channel was at full scale
};

/// All of `frames`, captured or imported, in their order: linearised, each less the mean lamps-off frame of the same
/// exposure and gain where the session has one (it holds the black level already), else less its black level.
/// Frames are read in parallel.
std::vector<Radiance> read_radiances(const Session& session, const std::vector<FrameRecord>& frames,
                                     const WorkContext& work);

}  // namespace darkbox
