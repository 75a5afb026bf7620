#pragma once

#include "rig/description/rig_description.h"
#include "rig/description/toml_section.h"

namespace darkbox {

/// [camera], with [camera.intrinsics].
CameraDescription read_camera(TomlSection& section);

}  // namespace darkbox
