#pragma once

#include <cstdint>

#include "acquisition/frame/progress.h"
#include "processing/maps/maps.h"

namespace darkbox {

struct TexelOptions {
    int albedo_clusters = 8;         ///< k of the first step, 1...256
    int neighbourhood_clusters = 8;  ///< k of the second step inside each albedo group, 1...256
    int window = 5;                  ///< side of the neighbourhood, pixels, odd, 1...15
    int iterations = 30;             ///< of each k-means, at most
    int min_pixels = 1;              ///< a smaller texel joins the one most like it
    int max_pixels = 0;              ///< a larger texel is parted by its neighbourhoods; 0 = no limit
    std::uint64_t seed = 1;

    /// Throws InputError that names the field and the allowed range.
    void validate() const;
};

struct TexelResult {
    IndexMap index;
    double within_cluster_variance = 0;  ///< mean squared RGB distance to the texel's mean
    double variance_explained = 0;       ///< 1 - within / total, 0...1
    double seconds = 0;
};

/// Two-step k-means of the unshaded image: by albedo, then inside each group by the neighbourhood vector (thesis, texel
/// clustering). Seeded k-means++; no dead clusters; pixels outside the mask never enter a neighbourhood. Texels that
/// are too large are parted by k-means of their own; then those too small join, smallest first, the texel of the
/// nearest mean colour. Pixels that no window tells apart stay together, and an object of fewer than min_pixels is one
/// texel. Bit-identical on any number of threads. Throws InputError for an empty map, and for more than 65535 texels.
TexelResult cluster_texels(const AlbedoMap& albedo, const TexelOptions& options = {}, const WorkContext& work = {});

}  // namespace darkbox
