#pragma once

#include "rig/capture/session_review.h"
#include "rig/description/rig_description.h"

namespace darkbox {

/// Whether every lamp of a session shines from where it is known to stand: its mirror image on the ball beside the
/// object tells. Compared with the latest calibration of the rig among the sessions in the same folder, else with
/// rig.toml. Exchanged lamps put their frames in doubt, but in a session that is to become the reference itself.
/// Nothing where no mirror ball is in view. Throws InputError where a frame does not read.
SessionReview review_lamp_places(const SessionWriter& session, const RigDescription& rig);

}  // namespace darkbox
