#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "acquisition/frame/progress.h"
#include "processing/relight/relight.h"

namespace darkbox {

struct RelitPicture {
    std::string name;     ///< "left"
    std::string caption;  ///< where the light is, in words
    cv::Mat3b image;      ///< for looking at
};

/// The object under lights that it was not photographed under: left, right, above, from below, and two colours at once.
/// All at one exposure, so that they can be compared.
std::vector<RelitPicture> relight_by_default(const RelightScene& scene, const WorkContext& work);

}  // namespace darkbox
