#pragma once

#include <vector>

#include "sim/mesh.h"

namespace darkbox::sim {

/// The Utah teapot (Newell 1975; Crow: The origins of the teapot, IEEE CG&A 7(1), 1987) in Newell's units and axes:
/// x to the spout, z up, the bottom at z = 0, 6.4 wide. The gap between pot and lid is closed by a ring.
/// One mesh for each part: body, lid, ring, bottom, handle, spout.
std::vector<TriangleMesh> teapot_parts();

}  // namespace darkbox::sim
