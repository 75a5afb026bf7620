#pragma once

#include <string>
#include <vector>

#include "rig/description/rig_description.h"
#include "sim/scene.h"

namespace darkbox::sim {

/// The scene that `sim.scene` names: a shape (sphere, torus, teapot, relief, card) and a texture (lambert, stone, moss,
/// marble, speckle, brick, weave, print, melon; lambert when none is named) joined by "-" in either order, and any of
/// the suffixes "near" (near lamps with 1/d^2), "perspective", "twoballs" and "threeballs": "brick-torus",
/// "teapot-moss-near". A material may be named as well: "phong60n30" has Phong's highlight of strength 0.60 (a white
/// matt surface has 1) and exponent 30, "phong" stands for "phong25n30"; "ggx30" is a plastic coat with GGX's width
/// alpha 0.30; "cloth40" is Oren and Nayar's matt facets with slopes of 0.40 radians. The picture is 200 mm wide at the
/// object; a mirror ball of `ball_diameter_mm` stands in its lower left corner, others above it. Throws InputError with
/// the known words when a word is unknown.
Scene scene_by_name(const SimDescription& sim, const std::vector<LampDescription>& lamps,
                    double ball_diameter_mm = 36.0);

}  // namespace darkbox::sim
