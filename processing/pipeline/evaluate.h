#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>

#include "acquisition/frame/progress.h"
#include "acquisition/session/session.h"
#include "processing/maps/maps.h"

namespace darkbox {

/// Angles between what was computed and what is true.
struct AngularError {
    double mean_deg = 0;
    double median_deg = 0;
    double p95_deg = 0;
    std::size_t count = 0;
};

struct Evaluation {
    std::optional<AngularError> normals;  ///< over pixels valid in both maps
    std::optional<AngularError> lights;   ///< over used lights, matched by file name, else by order
};

/// Compares a processed session with the truth that is known of it: data/given/ for imports (Normal_gt.mat), truth/
/// beside the payload for simulated captures (normals.exr, lights.lp). No stage computes with it; run_normals only
/// reports its error against an import's. Throws InputError when nothing was computed yet or no truth is known.
/// `reference_lights`, where given, is the truth for the lights instead, in the frames' order.
Evaluation evaluate_session(const Session& session, const std::optional<std::filesystem::path>& reference_lights = {},
                            const WorkContext& work = {});

/// Over pixels valid in both maps. Throws InputError when the sizes differ or no pixel is valid in both.
AngularError angular_error(const NormalMap& computed, const NormalMap& truth);

}  // namespace darkbox
