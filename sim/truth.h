#pragma once

#include <filesystem>
#include <vector>

#include "sim/scene.h"
#include "sim/sim_camera.h"

namespace darkbox::sim {

/// Writes what is true of a simulated session, for tests and reports; processing never reads it:
/// normals.exr (viewer frame), albedo.exr (linear), height.exr (Y = z, viewer frame, mm), mask.png (255 = object),
/// lights.lp (one line for each lamp, named after it), lamps.json (for each delivered frame: sequence, timestamp, lamps
/// really on and their share of the exposure), ball.json (circle in pixels). Throws DeviceError when the folder cannot
/// be written.
void write_truth(const Scene& scene, const std::vector<ExposureTruth>& exposures, const std::filesystem::path& folder);

}  // namespace darkbox::sim
