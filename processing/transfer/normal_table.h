#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <span>
#include <vector>

#include "processing/transfer/pyramid.h"

namespace darkbox {

// All directions in bins of about three degrees: a square whose points are the directions of an octahedron folded flat
// (Cigolini et al. 2014, "A Survey of Efficient Representations for Independent Unit Vectors", section 3.3). The far
// side is in it as well, so nothing is assumed of how a surface is turned.

constexpr int normal_bin_side = 64;
constexpr int normal_bins = normal_bin_side * normal_bin_side;

/// The bin of a unit normal.
int normal_bin(const cv::Vec3f& normal);
/// Of every valid pixel; -1 elsewhere.
cv::Mat1i normal_bin_map(const MapLevel& level);
/// The direction of a bin's middle.
cv::Vec3f bin_normal(int bin);

/// Which pixels of a map have a given normal: the look-up table that StyleBlit reads (Sykora et al. 2019), with all of
/// the pixels of a bin instead of one, for sources that are no sphere. Immutable after construction, thus thread-safe.
class NormalTable {
public:
    /// The level must have a valid pixel.
    explicit NormalTable(const MapLevel& level);

    /// The bin itself, or the one nearest in angle that has pixels.
    int filled_bin(int bin) const { return nearest_filled_[bin]; }

    /// Pixels of the bin in scan-line order; empty where there are none.
    std::span<const cv::Point> pixels(int bin) const {
        return {pixels_.data() + first_[bin], pixels_.data() + first_[bin + 1]};
    }

    /// One pixel of the filled bin nearest to a bin, told by a random number.
    cv::Point pick(int bin, std::uint32_t random) const {
        const std::span<const cv::Point> all = pixels(filled_bin(bin));
        return all[(std::uint64_t{random} * all.size()) >> 32];
    }

private:
    std::vector<std::size_t> first_;
    std::vector<cv::Point> pixels_;
    std::vector<int> nearest_filled_;
};

}  // namespace darkbox
