#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "rig/capture/capture_run.h"

namespace darkbox {

/// One lamp that somebody wants to see burn.
struct HandLight {
    LampId lamp;
    Seconds time{0};
    std::string object;  ///< that lies in its light; empty: nobody said
};

/// Whose light it is when nobody says what lies there: no object's, and no budget's.
std::string account_of(const RigDescription& rig);

/// The lamp of this name. `time`: none for as long as may be. Throws InputError for an unknown lamp, or a time beyond
/// nine tenths of its max_on_s: what guards the lamps takes one that reaches max_on_s for forgotten.
HandLight light_by_hand(const RigDescription& rig, const std::string& lamp, std::optional<Seconds> time,
                        const std::string& object);

/// Lights the lamp for its time, or until `work` is cancelled, and books the light in the folder of the sessions. The
/// lamps are dark when it returns or throws. `look` is called every 20 ms while the lamp is lit; what it throws ends
/// the light (see InterlockedLamps::watch()). Throws DoseExceeded, with nothing lit, when the object's budget does not
/// bear all of it; Cancelled when that came before the light; DeviceError.
void shine(const HandLight& light, const RigDescription& rig, LampArray& lamps, Clock& clock,
           const std::filesystem::path& sessions, const WorkContext& work, const std::function<void()>& look);

}  // namespace darkbox
