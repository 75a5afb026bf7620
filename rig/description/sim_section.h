#pragma once

#include "rig/description/rig_description.h"
#include "rig/description/toml_section.h"

namespace darkbox {

/// Whether a scene's name, words joined by '-', has this one.
bool is_word_of_scene(const std::string& scene, const std::string& word);

/// [sim].
SimDescription read_sim(TomlSection& section);

/// The simulator draws from where the description says that the camera is, and the description of a perspective scene
/// tells the simulator's own place where it says nothing.
void settle_simulated_camera(RigDescription& rig);

}  // namespace darkbox
