#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "acquisition/session/session.h"
#include "rig/capture/capture_run.h"

namespace darkbox {

/// The object of a session of flat frames, where none is named.
inline constexpr const char* flat_object = "flat";

/// Frames of a card under some lamps, with those without a lamp that belong to them, as they go into the
/// object's session: under frames/flat/.
struct FlatFrames {
    SessionReference of;
    std::vector<FrameRecord> records;
    std::vector<std::filesystem::path> files;  ///< of those
};

/// Throws InputError when `flats` was not captured by this rig (see difference_from()), or has no verified flat frame
/// of one of these lamps.
FlatFrames flats_for(const std::vector<LampId>& lamps, const Session& flats, const RigDescription& rig);

/// Throws InputError when they are of a camera of another name, or of other pictures.
void require_camera_of_flats(const Session& flats, const CameraInfo& camera);

}  // namespace darkbox
