#pragma once

#include "processing/relight/relight.h"

namespace darkbox {

// What rendering asks of its inputs. Each throws InputError that names what is wrong.

/// Maps of one size, labels of the texels, finite shading, unit normals where there are any.
void require_scene(const RelightScene& scene);

/// Finite, not negative, not empty.
void require_probe(const Environment& environment);

/// A place off the object, and a scene that knows where its pixels lie.
void require_near_lamp(const Light& lamp, const SceneGeometry& geometry);

/// `value` as in "relight: exposure is -1, allowed are 0...1000000".
void require_range(const char* field, double value, double lowest, double highest);

}  // namespace darkbox
