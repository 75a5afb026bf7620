#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "processing/relight/relight.h"

namespace darkbox {

/// A light without a name. A probe's patch lights S by intensity = radiance x solid angle / pi.
struct DistantLight {
    cv::Vec3f direction;
    cv::Vec3f intensity;
};

/// The probe in at most 64 x 32 patches, each a light in the patch's radiance-weighted mean direction, so that a small
/// bright source stays where it is; dark patches are left out. `yaw` as in RelightOptions.
std::vector<DistantLight> probe_lights(const Environment& environment, double yaw);

/// A probe folded over normals and levels. V is fixed, so r depends on the normal alone, and with w the summed weights
/// of linear interpolation: sum over lights of E x S(k, r(N, L)) = sum over levels of w(N, level) x S(k, level).
/// Exact at the nodes of a grid over the hemisphere of normals that face the viewer, bilinear between them; normals
/// that face away count as the rim's. Immutable after construction, thus thread-safe.
class FoldedEnvironment {
public:
    FoldedEnvironment(const std::vector<DistantLight>& lights, const ShadingMaps& maps, const RelightOptions& options);

    /// Of texel `label` with that unit normal.
    cv::Vec3f radiance(const cv::Vec3f& normal, int label) const;

private:
    /// R, G, B and one lane to spare, in a register.
    using Colour [[gnu::vector_size(16)]] = float;

    const Colour* node(int row, int column) const;

    int levels_;
    std::vector<Colour> weights_;  ///< [row][column][level]
    std::vector<Colour> shading_;  ///< [texel][level]
};

}  // namespace darkbox
