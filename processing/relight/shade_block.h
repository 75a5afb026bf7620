#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "processing/relight/environment.h"
#include "processing/relight/near_rays.h"
#include "processing/relight/pixel_block.h"
#include "processing/relight/relight.h"
#include "processing/relight/relighter.h"

namespace darkbox {

/// A light with what a near lamp needs beyond a distant one's.
struct FrameLight {
    DistantLight distant;  ///< of a near lamp the intensity alone
    std::optional<NearLamp> near;
};

/// What one frame is rendered with. Tables are of R, G, B and one lane to spare; a label is a texel's, 0 is black.
struct Frame {
    const cv::Vec4f* shading = nullptr;  ///< [label][level]
    int levels = 0;

    // Lit by either lights, or an environment, or as if r were the same everywhere.
    std::vector<FrameLight> lights = {};
    bool near = false;  ///< any of the lights
    const FoldedEnvironment* environment = nullptr;
    float constant_r = -1;  ///< negative: not so

    RelightOptions options = {};
};

// One block through shading, detail and exposure to its pixels in R, G, B: 3 x 64 values. The vectors' lanes are
// pixels, so that a pixel's value depends on nothing but itself. `points` are where the pixels' surface lies, null
// where no light is near.

void shade_to_floats(const Frame& frame, const PixelBlock& block, const PointBlock* points, float* rgb);
void shade_to_bytes(const Frame& frame, const CompactBlock& block, const PointBlock* points, Encoding encoding,
                    std::uint8_t* rgb);

/// Unit normals to 16 bits, detail to half floats (65504 at most).
CompactBlock compacted(const PixelBlock& block);

}  // namespace darkbox
