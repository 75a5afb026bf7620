#pragma once

#include <filesystem>
#include <vector>

#include "sim/scene.h"
#include "sim/sim_camera.h"

namespace darkbox::sim {

/// Writes what is true of a simulated session, for tests and reports; processing never reads it:
/// normals.exr (viewer frame), albedo.exr (linear), height.exr (Y = z, viewer frame, mm), mask.png (255 = object),
/// texels.png (16 bit: the material of the object's texture, from 1; 0 = outside),
/// lights.lp (one line for each lamp, named after it), lamps.json (for each delivered frame: sequence, timestamp, lamps
/// really on and their share of the exposure), ball.json (circle in pixels). Throws DeviceError when the folder cannot
/// be written.
void write_truth(const Scene& scene, const std::vector<ExposureTruth>& exposures, const std::filesystem::path& folder);

}  // namespace darkbox::sim
