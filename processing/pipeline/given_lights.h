#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "acquisition/session/session.h"
#include "processing/maps/lights.h"

namespace darkbox {

struct GivenLights {
    Lights lights;  ///< one per file, named after it
    std::vector<std::string> warnings;
    bool intensities = false;  ///< came with the pictures too
};

/// Lights from a file for these photographs: by name where the file has names that fit, else in order. Throws
/// InputError when a photograph has no light, or the numbers differ.
GivenLights lights_for(const std::vector<std::string>& files, const std::filesystem::path& lights,
                       const std::optional<std::filesystem::path>& intensities);

/// The lights that came with a session's pictures (data/given/), if any. The lights are named after the frame files.
std::optional<GivenLights> given_lights(const Session& session);

}  // namespace darkbox
