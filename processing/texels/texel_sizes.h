#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "processing/maps/maps.h"
#include "processing/texels/kmeans.h"
#include "processing/texels/texels.h"

namespace darkbox {

/// The pixels of one texel, in reading order.
using TexelPixels = std::vector<cv::Point>;

/// Parts texels of more than options.max_pixels by their neighbourhood vectors, as cluster_texels() says.
std::vector<TexelPixels> without_large(const AlbedoMap& albedo, std::vector<TexelPixels> texels,
                                       const TexelOptions& options);

/// Joins texels of fewer than `min_pixels` to others, as cluster_texels() says.
std::vector<TexelPixels> without_small(const AlbedoMap& albedo, std::vector<TexelPixels> texels, int min_pixels);

/// One list for each cluster, in the order of its centres.
std::vector<TexelPixels> split(const TexelPixels& pixels, const KMeansResult& clusters);

}  // namespace darkbox
