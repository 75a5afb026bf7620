#pragma once

#include "acquisition/frame/units.h"

namespace darkbox {

/// Times below a second are written in milliseconds in rig.toml.
inline Seconds milliseconds(double ms) { return Seconds(ms / 1000.0); }
inline double as_milliseconds(Seconds s) { return s.count() * 1000.0; }

}  // namespace darkbox
