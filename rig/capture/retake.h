#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "acquisition/session/session.h"
#include "rig/capture/capture_run.h"

namespace darkbox {

/// Some lamps of a sealed session to be taken again, into a session of its own that takes the rest over.
struct Retake {
    SessionReference of;
    CapturePlan plan;                          ///< what is to be captured: at each exposure dark, the lamps, dark
    std::vector<FrameRecord> taken_over;       ///< of the old session, as they go into the new one
    std::vector<std::filesystem::path> files;  ///< of those
    std::vector<std::string> order;            ///< names of all frames of the new session
};

/// `lamps`: names; empty: those with a frame that was not verified. Retaken frames keep their names and exposures;
/// frames without a lamp are taken besides, so that each frame has those of its own run. Unverified frames are left
/// behind. Throws InputError when the session is no capture of this rig (its name, its lamps and their outputs, the
/// geometry), or has no such lamp, or when nothing is to be taken again.
Retake plan_retake(const Session& old, const RigDescription& rig, const std::vector<std::string>& lamps);

/// Throws InputError when this is not the camera that the session was captured with: its identity, its mode (size,
/// format, depth, black level), or the session's exposure and gain, `asked`, do not come out as they were.
void require_same_camera(const Session& old, const CameraInfo& camera, const CameraConfig& asked);

/// How the rig of a captured session differs from this one, in words: its name, its lamps and their outputs, the
/// geometry, whether the room's light is kept out.
std::optional<std::string> difference_from(const Session& old, const RigDescription& rig);

/// "model (id)": how a session names a camera.
std::string identity_of(const CameraInfo& camera);

}  // namespace darkbox
