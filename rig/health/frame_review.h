#pragma once

#include "rig/capture/session_review.h"
#include "rig/description/rig_description.h"

namespace darkbox {

/// What a session's own frames tell of the rig, before it is sealed. Throws InputError where a frame does not read.
///
/// Whether every lamp shines from where it is known to stand: its mirror image on the ball beside the object tells.
/// Compared with the latest calibration of the rig among the sessions in the same folder, else with rig.toml. Exchanged
/// lamps put their frames in doubt, but in a session that is to become the reference itself. Nothing where no mirror
/// ball is in view, or rig.capture.lamp_places is false.
///
/// Whether object or camera moved between the first and the last frame of one lamp, where the session has two or more.
SessionReview review_frames(const SessionWriter& session, const RigDescription& rig);

}  // namespace darkbox
