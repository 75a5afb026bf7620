#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "processing/calibration/rig_identity.h"
#include "processing/maps/lights.h"

namespace darkbox {

/// What is known of a rig's lamps at one time: a stored calibration, or the rig's own description.
struct RigLights {
    RigIdentity rig;  ///< its lamps name the lights, in their order
    Lights lights;
    bool intensities_known = false;
};

enum class OtherRig {
    refuse,
    compare,  ///< even so; lamps that share no name are matched by their place
};

struct DriftOptions {
    double false_alarm = 0.01;       ///< chance that any of the lamps is called moved when all stand still
    double unknown_sigma_deg = 0.5;  ///< per tangent axis, taken where a calibration does not know its own
    double same_place_deg = 1.0;     ///< lamps swapped, or two in one place, agree at least this well
    double dim_ratio = 0.7;          ///< of the intensity before, relative to the other lamps
    double dead_ratio = 0.05;
    OtherRig other_rig = OtherRig::refuse;

    /// Throws InputError that names the field and the allowed range.
    void validate() const;
};

enum class LampFinding {
    steady,
    moved,
    swapped,    ///< shines from where its partner was; both ways, or in a ring of several
    duplicate,  ///< shines from where its partner was and still is: one lamp under two names
    dim,
    dead,    ///< sends hardly any light
    unread,  ///< left out of one calibration, so nothing can be said
};
const char* name(LampFinding finding);

/// One lamp that both calibrations know.
struct LampDrift {
    std::string lamp;
    LampFinding finding = LampFinding::steady;  ///< the gravest; a lamp that moved may be dim as well
    double raw_deg = 0;                         ///< between the two stored directions
    double moved_deg = 0;                       ///< less the camera's rotation, where that was knocked
    double sigma_deg = 0;                       ///< of moved_deg per tangent axis
    double p_value = 1;                         ///< of moving as far by chance: chi-squared, two degrees of freedom
    bool sigma_assumed = false;                 ///< one of the calibrations did not know its covariance
    /// Near lamps: how much farther from the object than before, mm, less what the scale changed for all of them; its
    /// standard deviation, 0 where a position's covariance is not known.
    std::optional<double> farther_mm;
    double farther_sigma_mm = 0;
    std::string partner;                    ///< the other lamp of a swap or duplicate
    std::optional<double> intensity_ratio;  ///< after over before, the median lamp's being 1
};

/// Every direction turned alike: the camera was knocked, or the dome as a whole.
struct CameraKnock {
    double angle_deg = 0;
    Eigen::Vector3d axis{0, 0, 1};  ///< viewer frame; the lights turn about it, right-handed
    std::size_t lamps = 0;          ///< that follow it
    double p_value = 1;
};

struct Drift {
    std::vector<LampDrift> lamps;  ///< in the first calibration's order
    std::vector<std::string> only_before, only_after;
    std::optional<CameraKnock> knock;
    std::vector<std::string> findings;  ///< in words, gravest first; empty: nothing moved

    bool steady() const { return findings.empty(); }
};

/// Compares two calibrations of one rig, lamp by lamp, matched by name. A common rotation is fitted robustly; where it
/// is significant and a majority of lamps follow it, it is the camera's, and each lamp is judged by what remains
/// against the rotation of the others. Errors of one ball turn all lamps together, so the rotation must exceed what
/// one single lamp's uncertainty would explain. Near lamps are compared as the first calibration's object sees them,
/// and by their distances from it, where these are known. Throws InputError for calibrations of different rigs, and for
/// a lamp that is near in one and distant in the other.
Drift drift_between(const RigLights& before, const RigLights& after, const DriftOptions& options = {});

}  // namespace darkbox
