#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "sim/scene.h"
#include "sim/sensor.h"

namespace darkbox::sim {

/// What a monochrome camera would see of a scene: one picture for each lamp burning alone, its samples the mean of the
/// three colours' radiance. Rendered where there is a fast machine, kept in a file, exposed in a slow one.
class TwinPictures {
public:
    /// Renders the scene.
    explicit TwinPictures(const Scene& scene);
    /// Throws InputError for a file that write() did not make.
    explicit TwinPictures(const std::filesystem::path& file);
    void write(const std::filesystem::path& file) const;

    int width() const { return width_; }
    int height() const { return height_; }
    std::size_t lamps() const { return radiance_.size(); }

    /// A frame under these shares of each lamp's light, 1 = burned during the whole exposure.
    std::vector<std::uint16_t> expose(const Sensor& sensor, const std::vector<double>& shares,
                                      const ExposureSetting& setting) const;

private:
    int width_ = 0;
    int height_ = 0;
    std::vector<std::vector<float>> radiance_;  ///< by lamp
};

}  // namespace darkbox::sim
