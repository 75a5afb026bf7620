#include "processing/normals/pixel_sample.h"

#include <cmath>

#include "processing/maps/photo_pixel.h"
#include "processing/normals/least_squares_block.h"

namespace darkbox {
namespace {

float channel_mean(const cv::Vec3f& rgb) { return (rgb[0] + rgb[1] + rgb[2]) * (1.0F / 3.0F); }

}  // namespace

float mean_intensity(const SolverLight& light) { return 3.0F / (light.gain[0] + light.gain[1] + light.gain[2]); }

void SampleRow::load(const PhotoBand& band, const LightSet& set, int row) {
    cols_ = band.cols();
    colours_.resize(set.lights.size() * static_cast<std::size_t>(cols_));
    clipped_.resize(colours_.size());
    for (std::size_t k = 0; k < set.lights.size(); ++k) {
        const SolverLight& light = set.lights[k];
        const PhotoRows& photo = band.photos[light.image];
        cv::Vec3f* colours = &colours_[at(k, 0)];
        radiance_row(photo, row, colours);
        for (int x = 0; x < cols_; ++x) {
            clipped_[at(k, x)] = clipped_at(photo, row, x);
            for (int c = 0; c < 3; ++c) colours[x][c] *= light.gain[static_cast<std::size_t>(c)];
        }
    }
}

bool SampleRow::finite(int column) const {
    float trace = 0;
    for (std::size_t k = 0; at(k, column) < colours_.size(); ++k) trace += channel_mean(colour(k, column)) * 0.0F;
    return trace == 0.0F;
}

void SampleRow::fill(const LightField& field, const std::vector<Arrival>& arrivals, const NoiseModel& noise, int column,
                     PixelSamples& samples) const {
    samples.resize(arrivals.size());
    for (std::size_t k = 0; k < arrivals.size(); ++k) {
        const Arrival& arrival = arrivals[k];
        const float intensity = mean_intensity(field.set().lights[k]);
        const float mean = channel_mean(colour(k, column));
        const float to_one = 1.0F / arrival.falloff, per_radiance = to_one / intensity;
        samples.value[k] = mean * to_one;
        samples.noise_variance[k] =
            static_cast<float>(noise.variance(static_cast<double>(mean * intensity))) * per_radiance * per_radiance;
        samples.x[k] = arrival.direction.x();
        samples.y[k] = arrival.direction.y();
        samples.z[k] = arrival.direction.z();
        samples.usable[k] = clipped_[at(k, column)] ? 0 : 1;
    }
}

}  // namespace darkbox
