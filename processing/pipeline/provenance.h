#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "acquisition/session/session.h"

namespace darkbox {

/// Puts into pictures made from this session (PNG, JPEG; others are left as they are) what is known of the object, and
/// how the pictures came about: darkbox' version, session, rig, camera, time of capture, the checksum of the session's
/// manifest, which stands for every bit of it, `what` they show, and the choices of all stages that have run so far.
/// Nothing of the moment of processing goes in: the same inputs give the same bits. `parameters` are those of the last
/// step, as "model=phong".
void describe_pictures(const Session& session, std::string_view what,
                       const std::vector<std::filesystem::path>& pictures,
                       const std::vector<std::string>& parameters = {});

}  // namespace darkbox
