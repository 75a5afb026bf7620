#pragma once

#include <string>

namespace darkbox::test {

struct RigText {
    std::string device = "/dev/video0";  ///< of [camera]
    std::string camera = {};             ///< more lines of [camera]
    std::string chip = "lamps";          ///< of [lamps.gpio]
    std::string extra = {};              ///< more sections
    int lamps = 16;
};

/// A rig.toml with a V4L2 camera and lamps on the GPIO lines of their numbers, lamp-01 on line 0 and so on, in the
/// places of the simulated rig.
std::string rig_toml(const RigText& rig);

}  // namespace darkbox::test
