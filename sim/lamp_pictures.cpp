#include "sim/lamp_pictures.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "acquisition/frame/error.h"
#include "sim/renderer.h"

namespace darkbox::sim {
namespace {

/// The samples of one row of interleaved RGB.
void sample_row(std::span<const float> rgb, int row, SensorColour colour, std::span<float> samples) {
    if (colour == SensorColour::rgb) {
        std::copy(rgb.begin(), rgb.end(), samples.begin());
        return;
    }
    for (std::size_t column = 0; column < samples.size(); ++column) {
        const auto pixel = rgb.subspan(3 * column, 3);
        samples[column] = colour == SensorColour::grey ? (pixel[0] + pixel[1] + pixel[2]) / 3
                                                       : pixel[static_cast<std::size_t>(row % 2) + column % 2];
    }
}

}  // namespace

SensorColour sensor_colour_from_name(const std::string& name) {
    if (name == "rgb") return SensorColour::rgb;
    if (name == "grey") return SensorColour::grey;
    if (name == "rggb") return SensorColour::rggb;
    throw InputError(fmt::format("sim.colour is \"{}\", but must be rgb, grey or rggb", name), "correct rig.toml");
}

int samples_per_pixel(SensorColour colour) { return colour == SensorColour::rgb ? 3 : 1; }

std::vector<float> sampled(const RgbImage& picture, SensorColour colour) {
    const auto row_samples = static_cast<std::size_t>(picture.width * samples_per_pixel(colour));
    std::vector<float> samples(row_samples * static_cast<std::size_t>(picture.height));
    for (int row = 0; row < picture.height; ++row)
        sample_row({picture.pixel(0, row), 3 * static_cast<std::size_t>(picture.width)}, row, colour,
                   std::span(samples).subspan(static_cast<std::size_t>(row) * row_samples, row_samples));
    return samples;
}

LampPictures::LampPictures(std::shared_ptr<const Scene> scene, SensorColour colour)
    : scene_(std::move(scene)), colour_(colour) {}

std::span<const float> LampPictures::of(LampId lamp) {
    if (pictures_.empty()) {
        // All at once: the rays from the camera are then traced once, not once for each lamp.
        std::vector<LampId> all(scene_->lamps.size());
        for (std::size_t i = 0; i < all.size(); ++i) all[i].value = static_cast<std::uint32_t>(i);
        const View& view = scene_->view;
        const auto row_samples = static_cast<std::size_t>(view.width * samples_per_pixel(colour_));
        pictures_.assign(all.size(), std::vector<float>(row_samples * static_cast<std::size_t>(view.height)));
        Renderer(*scene_).render(all, [&](std::size_t picture, int row, std::span<const float> rgb) {
            sample_row(rgb, row, colour_,
                       std::span(pictures_[picture]).subspan(static_cast<std::size_t>(row) * row_samples, row_samples));
        });
    }
    return pictures_.at(lamp.value);
}

}  // namespace darkbox::sim
