#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "acquisition/frame/progress.h"
#include "acquisition/session/session.h"
#include "processing/calibration/circle_fit.h"
#include "processing/pipeline/angular_error.h"
#include "processing/pipeline/held_out.h"
#include "processing/pipeline/paired_bootstrap.h"

namespace darkbox {

/// What normals are compared with.
enum class NormalTruth {
    known,         ///< data/given/ of imports (Normal_gt.mat), truth/ beside the payload of simulated captures
    ideal_sphere,  ///< of a ball seen orthographically: the sphere that its mask outlines
};

struct EvaluateOptions {
    std::optional<Solver> solver;   ///< none: the one that made the session's results, else least squares
    std::vector<std::string> drop;  ///< frame files left out of every fit, beside those the calibration left out
    NormalTruth truth = NormalTruth::known;
    std::vector<Solver> compare;  ///< two solvers to compare pixel by pixel against the truth; empty: none
    PairedBootstrapOptions bootstrap;
    std::optional<std::filesystem::path> reference_lights;  ///< the lights' truth, in the frames' order
    bool held_out = true;                                   ///< leave one light out
    int memory_mib = 4096;  ///< for all photographs at once and what is solved from them

    /// Throws InputError that names the field and the allowed range.
    void validate() const;
};

struct LightErrors {
    AngularError all;                ///< over used lights
    std::vector<std::string> files;  ///< of the used lights
    std::vector<double> error_deg;   ///< one per file
};

/// Both solvers on the same pixels: those that both solved and whose truth is known.
struct SolverComparison {
    struct One {
        Solver solver = Solver::lsq;
        AngularError error;
        double seconds = 0;  ///< of solving
    };
    One first, second;
    PairedBootstrap difference;  ///< of the angular errors, degrees: second less first

    bool second_is_better() const { return difference.high < 0; }
};

struct Evaluation {
    Solver solver = Solver::lsq;          ///< of normals and held_out
    std::optional<AngularError> normals;  ///< over pixels valid in both maps
    std::optional<Circle> ideal_sphere;   ///< pixels, where it is the truth
    std::optional<SolverComparison> comparison;
    std::optional<LightErrors> lights;
    std::vector<std::string> predictors;  ///< of held_out
    std::vector<HeldOutLight> held_out;
    std::vector<std::string> warnings;
};

/// Measures a calibrated session; nothing is written. Angular errors are those of the stored results, or of a fit in
/// memory where there are none or where `solver` or `drop` ask for another; near lights then fall on the surface of the
/// stored results. No stage computes with the truth;
/// run_normals only reports its error against an import's. Throws InputError when the session is not calibrated, when
/// `truth` or `compare` ask for a truth that is not there, or a frame to drop is not one of the session.
Evaluation evaluate_session(const Session& session, const EvaluateOptions& options = {}, const WorkContext& work = {});

}  // namespace darkbox
