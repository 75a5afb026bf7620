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

/// A probe folded over normals and texels. V is fixed, so r depends on the normal alone, and with w the summed weights
/// of linear interpolation: sum over lights of E x S(k, r(N, L)) = sum over levels of w(N, level) x S(k, level) =
/// F(N, k), a table. Exact at the nodes of a grid over the hemisphere of normals that face the viewer, bilinear between
/// them; normals that face away count as the rim's. The grid's steps are 1.5 to 3 degrees: Phong lobes narrower than
/// that are softened. Beyond 8192 texels the grid is coarser, so that the table stays below half a gibibyte.
/// Immutable after construction, thus thread-safe.
class FoldedEnvironment {
public:
    FoldedEnvironment(const std::vector<DistantLight>& lights, const ShadingMaps& maps, const RelightOptions& options);

    /// R, G, B and one lane to spare.
    using Colour = cv::Vec4f;

    int nodes() const { return nodes_; }  ///< per side of the grid
    int texels() const { return texels_; }
    /// [row][column][label], label 0 is black.
    const Colour* shading() const { return shading_.data(); }
    /// Of the specular part that does not go through S, [row][column]; empty for models without.
    const std::vector<Colour>& mirrored() const { return mirrored_; }

private:
    int nodes_;
    int texels_;
    std::vector<Colour> shading_;
    std::vector<Colour> mirrored_;
};

}  // namespace darkbox
