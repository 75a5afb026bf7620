#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "acquisition/frame/progress.h"
#include "processing/maps/maps.h"

namespace darkbox {

enum class ReflectanceModel { lambert, phong };
enum class Lookup {
    thesis,  ///< the texel's radiance as it is
    detail,  ///< scaled by the pixel's own albedo over its texel's mean
};

struct RelightOptions {
    ReflectanceModel model = ReflectanceModel::lambert;
    Lookup lookup = Lookup::detail;
    double phong_specular = 0.3;   ///< k_s, 0...1; k_d = 1 - k_s
    double phong_exponent = 20.0;  ///< 1...1000
    double environment_yaw = 0.0;  ///< radians; right-handed about +y: what stood behind the object moves to the left
    double exposure = 1.0;         ///< factor on the result

    /// Throws InputError that names the field and the allowed range.
    void validate() const;
};

/// What is relit: maps of one size.
struct RelightScene {
    NormalMap normals;
    AlbedoMap albedo;
    IndexMap index;
    ShadingMaps shading;
};

/// A light probe: equirectangular linear radiance, R, G, B. Row 0 is straight up (+y), the middle column looks along -z
/// (away from the camera, behind the object); columns grow to the viewer's right. Gauge: a patch of solid angle dw
/// lights like a lamp of intensity radiance x dw / pi, so a uniform probe of radiance 1 shows a Lambert surface in its
/// albedo.
struct Environment {
    cv::Mat3f radiance;
};

struct RelightResult {
    cv::Mat3f image;            ///< linear radiance; 0 outside the object
    double fold_seconds = 0;    ///< environment: building its table
    double render_seconds = 0;  ///< the frame itself
};

/// Sum over lights of intensity x S(k, r_i): radiances add, coefficients do not (thesis, relighting). r beyond the last
/// level is clamped. Lights not `used` are left out. Bit-identical on any number of threads. Throws InputError for maps
/// that do not fit together, normals or directions that are not unit vectors, and when no light is left.
RelightResult relight(const RelightScene& scene, const Lights& lights, const RelightOptions& options = {},
                      const WorkContext& work = {});

/// Under an environment: since V is fixed, r depends on the normal alone, so the probe is folded once into weights over
/// normals and levels. The fold takes the probe as about two thousand lights and normals in steps of 1.5 to 3 degrees:
/// Phong lobes narrower than that are softened. Throws InputError for a probe that is empty, negative or not finite.
RelightResult relight(const RelightScene& scene, const Environment& environment, const RelightOptions& options = {},
                      const WorkContext& work = {});

/// The object with the same coefficient r, 0...1, in every pixel: a stack over r shows how its texture changes from
/// dark to bright (thesis, the pseudo-BTF figure). Throws InputError as relight() does.
cv::Mat3f at_constant_coefficient(const RelightScene& scene, double r, const RelightOptions& options = {},
                                  const WorkContext& work = {});

}  // namespace darkbox
