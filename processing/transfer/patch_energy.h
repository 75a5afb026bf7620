#pragma once

#include <opencv2/core.hpp>
#include <optional>

#include "processing/transfer/appearance.h"

namespace darkbox {

/// Pictures of 1 or 2 layers, all of one size, whose pixels lie side by side in memory: the colours of a patch, and its
/// normals where they count.
struct PatchLayers {
    cv::Mat bytes;     ///< 8 bits, 3 or 6 channels
    cv::Mat1b inside;  ///< 255 where the whole patch around a pixel is valid
};

PatchLayers colour_patches(const Appearance& appearance, int window);
/// Colour and normal count alike, both in 8-bit units: (n + 1) / 2 * 255.
PatchLayers joint_patches(const Appearance& appearance, int window);

/// Mean over the target's patches on a grid of `stride` pixels of the RMS difference to the nearest of all patches of
/// the source, in the 8-bit units of one colour channel; exact. The square sum of both layers is divided by the numbers
/// of one, so that energies with and without normals can be compared. std::nullopt where either has no whole patch.
std::optional<double> patch_energy(const PatchLayers& source, const PatchLayers& target, int window, int stride);

}  // namespace darkbox
