#pragma once

#include "sim/geometry.h"

namespace darkbox::sim {

// Laws of reflection beyond Lambert's, for unit vectors with n.l > 0 and n.v > 0. Each is pi times the BRDF: a white
// matt surface has 1. All but phong_lobe() are reciprocal: l and v may be exchanged.

/// Phong's highlight over n.l (CACM 18(6) 1975): radiance under irradiance 1 on a facing surface is
/// strength (r.v)^exponent whatever n.l is.
double phong_lobe(const Vec3& n, const Vec3& l, const Vec3& v, double strength, double exponent);

/// Microfacets of a smooth dielectric coat of index 1.5: GGX with Smith's masking (Walter, Marschner, Li and Torrance,
/// EGSR 2007) and Schlick's Fresnel term. `alpha` is the width: 0.1 polished, 0.5 dull.
double ggx(const Vec3& n, const Vec3& l, const Vec3& v, double alpha);

/// What passes such a coat on its way to the body and back, by Schlick's term: keeps coat and body together from
/// returning more light than came.
double coat_transmission(const Vec3& n, const Vec3& l, const Vec3& v);

/// Oren and Nayar's matt facets, the qualitative model (SIGGRAPH 1994, equation 30), relative to the albedo.
/// `slope_sigma` is the standard deviation of the facets' slopes, radians.
double oren_nayar(const Vec3& n, const Vec3& l, const Vec3& v, double slope_sigma);

}  // namespace darkbox::sim
