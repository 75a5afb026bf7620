#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "acquisition/frame/ids.h"
#include "acquisition/frame/units.h"

namespace darkbox {

class StrobedLamps;

struct LampHealth {
    bool reachable = true;
    std::vector<std::string> problems = {};    ///< sentences for people; empty when all is well
    std::optional<double> temperature_c = {};  ///< of the lamps' heat sink; none: there is no thermometer
};

/// The lamps of a rig; at most one is lit. Every implementation is dark before its constructor returns and after its
/// destructor ran, whatever happened between. Thread-compatible: one thread drives it.
class LampArray {
public:
    virtual ~LampArray() = default;
    virtual std::size_t size() const = 0;
    /// Lights this lamp alone, the others dark. `level` in (0, 1]. Throws DeviceError.
    virtual void light(LampId lamp, double level) = 0;
    /// All lamps dark. Throws DeviceError when that cannot be confirmed.
    virtual void dark() = 0;
    virtual LampHealth health() = 0;
    /// The same lamps as stepped by the camera's strobe; null for lamps without such a line. Lives as long as this.
    virtual StrobedLamps* strobed() { return nullptr; }
};

/// Darkens the lamps on every way out of a scope. The destructor swallows the error: by then one is already under way.
class DarkOnExit {
public:
    explicit DarkOnExit(LampArray& lamps) : lamps_(lamps) {}
    DarkOnExit(const DarkOnExit&) = delete;
    DarkOnExit& operator=(const DarkOnExit&) = delete;
    ~DarkOnExit() {
        try {
            lamps_.dark();
        } catch (...) {  // NOLINT(bugprone-empty-catch)
        }
    }

private:
    LampArray& lamps_;
};

}  // namespace darkbox
