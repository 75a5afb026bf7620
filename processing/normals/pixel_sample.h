#pragma once

#include <cstddef>
#include <opencv2/core.hpp>
#include <vector>

#include "processing/maps/photo_source.h"
#include "processing/normals/light_field.h"
#include "processing/normals/noise_model.h"
#include "processing/normals/pixel_solver.h"

namespace darkbox {

/// One row of a band, decoded for solvers that work pixel by pixel: the mean over channels of every photograph, each
/// channel divided by its light's intensity. Owns buffers that it uses again. Thread-compatible.
class SampleRow {
public:
    void load(const PhotoBand& band, const LightSet& set, int row);

    int cols() const { return cols_; }
    const cv::Vec3f& colour(std::size_t k, int column) const { return colours_[at(k, column)]; }  ///< per intensity
    /// All samples of a pixel are finite numbers.
    bool finite(int column) const;
    /// Fills what the solver fits: samples brought to irradiance 1 at this pixel.
    void fill(const LightField& field, const std::vector<Arrival>& arrivals, const NoiseModel& noise, int column,
              PixelSamples& samples) const;

private:
    std::size_t at(std::size_t k, int column) const {
        return k * static_cast<std::size_t>(cols_) + static_cast<std::size_t>(column);
    }

    int cols_ = 0;
    std::vector<cv::Vec3f> colours_;
    std::vector<char> clipped_;
};

/// The factor that takes the k-th light's mean sample to the radiance of its photograph.
float mean_intensity(const SolverLight& light);

}  // namespace darkbox
