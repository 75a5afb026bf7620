#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "acquisition/frame/progress.h"
#include "processing/maps/lights.h"
#include "processing/maps/maps.h"
#include "processing/maps/view.h"

namespace darkbox {

/// How normal and light become the radiance of a texel k, for V = (0, 0, 1) and R the mirrored light.
enum class ReflectanceModel {
    lambert,      ///< S(k, N.L)
    phong,        ///< S(k, k_d N.L + k_s (R.V)^n): one coefficient, the highlight is made of the texel's own radiance
    phong_split,  ///< k_d S(k, N.L) + k_s (R.V)^n x specular colour: the lamp mirrored in a coat of gloss
};
enum class Lookup {
    thesis,  ///< the texel's radiance as it is
    detail,  ///< scaled by the pixel's own albedo over its texel's mean
};
/// What a coefficient beyond the last level looks up: r > 1 where k_d + k_s > 1.
enum class OutOfRange {
    clamp,  ///< S(k, 1)
    scale,  ///< r x S(k, 1)
};

struct RelightOptions {
    ReflectanceModel model = ReflectanceModel::lambert;
    Lookup lookup = Lookup::detail;
    OutOfRange out_of_range = OutOfRange::clamp;
    double phong_diffuse = 0.7;             ///< k_d, 0...1
    double phong_specular = 0.3;            ///< k_s, 0...1
    double phong_exponent = 20.0;           ///< n, 1...1000
    cv::Vec3d specular_colour = {1, 1, 1};  ///< phong_split: radiance of a whole highlight, light of intensity 1; 0...1
    double environment_yaw = 0.0;  ///< radians; right-handed about +y: what stood behind the object moves to the left
    double exposure = 1.0;         ///< factor on the result, 0...1e9

    /// Throws InputError that names the field and the allowed range.
    void validate() const;
};

/// What is relit: maps of one size.
struct RelightScene {
    NormalMap normals;
    AlbedoMap albedo;
    IndexMap index;
    ShadingMaps shading;
    SceneGeometry geometry = {};  ///< for near lamps
};

/// A light probe: equirectangular linear radiance, R, G, B. Row 0 is straight up (+y), the middle column looks along -z
/// (away from the camera, behind the object); columns grow to the viewer's right. Gauge: a patch of solid angle dw
/// lights like a lamp of intensity radiance x dw / pi, so a uniform probe of radiance 1 shows a Lambert surface in its
/// albedo.
struct Environment {
    cv::Mat3f radiance;
};

/// The same coefficient r in every pixel, for a light of intensity 1: a stack over r shows how a texture changes from
/// dark to bright (thesis, the pseudo-BTF figure).
struct ConstantCoefficient {
    double r;  ///< 0...1
};

struct RelightResult {
    cv::Mat3f image;            ///< linear radiance; 0 outside the object
    double fold_seconds = 0;    ///< environment: building its table
    double render_seconds = 0;  ///< the frame itself
};

// One picture of a scene. Who needs several prepares a Relighter once.

/// Sum over lights of intensity x S(k, r_i): radiances add, coefficients do not (thesis, relighting). Lights not `used`
/// are left out. A near lamp's direction and fall-off are those at each pixel's point of the surface. Bit-identical on
/// any number of threads. Throws InputError for maps that do not fit together, normals or directions that are not unit
/// vectors, a near lamp where the scene's view is not known, and when no light is left.
RelightResult relight(const RelightScene& scene, const Lights& lights, const RelightOptions& options = {},
                      const WorkContext& work = {});

/// Under an environment, see FoldedEnvironment. Throws InputError for a probe that is empty, negative or not finite.
RelightResult relight(const RelightScene& scene, const Environment& environment, const RelightOptions& options = {},
                      const WorkContext& work = {});

}  // namespace darkbox
