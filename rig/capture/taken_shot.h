#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "acquisition/camera/camera.h"
#include "acquisition/session/session.h"

namespace darkbox {

/// One picture to take.
struct Shot {
    FrameKind kind = FrameKind::lit;
    std::optional<LampId> lamp;  ///< of a lit or flat shot; the others are dark or ambient
    CameraConfig camera;
    std::string name;               ///< of the file: "0003_lamp-04"
    std::string extension = "tif";  ///< jpg of a camera that gives JPEGs
};

/// Its place in the session.
inline std::string file_of(const Shot& shot) { return "frames/" + shot.name + "." + shot.extension; }

/// A proven picture of a shot.
struct TakenShot {
    Frame frame;
    TimePoint on;       ///< the lamp was confirmed lit (or dark, for a dark shot)
    TimePoint off;      ///< the lamp was told to go dark, or to make room for the next
    std::string words;  ///< what was checked and found
};

/// Shots that could not be proven on the way, and why, for each cause once.
struct Unproven {
    std::vector<Shot> shots;
    std::vector<std::string> reasons;
    bool stay_settled = false;  ///< it makes no sense to try again: no gap, or stamps that lie
};

using ShotSink = std::function<void(const Shot&, TakenShot)>;

}  // namespace darkbox
