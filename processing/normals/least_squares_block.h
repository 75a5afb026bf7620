#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>

#include "processing/maps/photo_source.h"
#include "processing/normals/light_set.h"

namespace darkbox {

// The arithmetic of least squares on a run of neighbouring pixels, for the widest vectors the processor has. A block's
// samples of all lights stay in the nearest caches between the passes over them. Every pixel's figures come from the
// same operations in the same order whatever the vectors' width and the block's place: same bits on every processor
// that multiplies and adds in one rounding.

inline constexpr int block_pixels = 128;

/// One float for each pixel of a block.
struct alignas(64) Plane {
    std::array<float, block_pixels> at;
};

/// A block's samples and what was found from them. Every plane holds `count` pixels; those after them are padding.
struct LeastSquaresBlock {
    explicit LeastSquaresBlock(std::size_t lights);

    Plane* rgb(std::size_t light) { return samples.get() + 3 * light; }
    const Plane* rgb(std::size_t light) const { return samples.get() + 3 * light; }
    float value(std::size_t light, int channel, std::size_t i) const { return rgb(light)[channel].at[i]; }

    int count = 0;
    std::unique_ptr<Plane[]> samples;               ///< radiance over intensity: R, G, B planes of each light
    std::array<std::uint8_t, block_pixels> mask{};  ///< not 0 on the object
    std::array<Plane, 3> g;                         ///< albedo times normal: x, y, z
    std::array<Plane, 3> colour;                    ///< sum of I_c (g.L)+
    Plane lit_weight;                               ///< sum of (g.L)+^2
    Plane squared;                                  ///< sum of squared residuals
    Plane samples_used;                             ///< lights behind each pixel
    Plane usable;  ///< 1 on the object where all samples are finite and enough of them not clipped, else 0
};

/// Where a block's results go: the places of its first pixel in the maps.
struct BlockResults {
    float* normal;  ///< interleaved
    float* albedo;  ///< interleaved
    float* residual;
    std::uint8_t* valid;
    std::uint16_t* lights_used;
};

/// One light's samples: rows' pixels [column, column + block.count) of `row`. Returns whether any of them is clipped.
bool load_photo(const PhotoRows& rows, int row, int column, const std::array<float, 3>& gain, std::size_t light,
                LeastSquaresBlock& block);

/// project() and accumulate_albedo() in one go for blocks as most are: linear samples without a dark frame, none of
/// them clipped. Pixels pass through all lights while their samples are in the nearest cache; `samples` is left
/// undefined. The same bits as by the other way. Returns what project() does, or no value where the block is of another
/// kind: then load its photographs.
std::optional<std::size_t> sum_plain_samples(const PhotoBand& band, const LightSet& set, int row, int column,
                                             LeastSquaresBlock& block);

/// g over all lights through the shared pseudo-inverse, and which pixels are usable: on the object, and without a
/// sample that is not finite, which leaves its trace in g. Returns how many pixels of the object are not finite.
std::size_t project(const LightSet& set, LeastSquaresBlock& block);

/// The sums behind albedo and residual over all lights. They use g where N is meant: the scale |g| cancels in finish().
void accumulate_albedo(const LightSet& set, LeastSquaresBlock& block);

/// Results of usable pixels that are not too dark; zeros for the others.
void finish(float min_albedo, const LeastSquaresBlock& block, const BlockResults& results);

}  // namespace darkbox
