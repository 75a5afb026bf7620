#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "acquisition/frame/ids.h"
#include "sim/image.h"
#include "sim/scene.h"

namespace darkbox::sim {

/// Which light the samples of a pixel count.
enum class SensorColour {
    rgb,   ///< three samples, one for each colour
    grey,  ///< one: the mean of the colours
    rggb,  ///< one, behind a mosaic whose first two rows are R G and G B
};
/// "rgb", "grey", "rggb". Throws InputError that names them for another name.
SensorColour sensor_colour_from_name(const std::string& name);
int samples_per_pixel(SensorColour colour);

/// The samples that a sensor takes of a picture.
std::vector<float> sampled(const RgbImage& picture, SensorColour colour);

/// What a sensor sees of a scene with each lamp burning alone at full level. All of them are rendered when the first is
/// asked for, and kept: 4 bytes a sample, 64 lamps of 1920 x 1080 mosaic pixels 506 MiB. Thread-compatible.
class LampPictures {
public:
    LampPictures(std::shared_ptr<const Scene> scene, SensorColour colour);

    SensorColour colour() const { return colour_; }
    /// Radiance, linear, the samples of a pixel interleaved, rows from the top.
    std::span<const float> of(LampId lamp);

private:
    std::shared_ptr<const Scene> scene_;
    SensorColour colour_;
    std::vector<std::vector<float>> pictures_;
};

}  // namespace darkbox::sim
