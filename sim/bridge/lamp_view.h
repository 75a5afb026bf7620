#pragma once

#include <vector>

namespace darkbox::sim {

/// Lamps as the twin's camera finds them when it looks. Thread-compatible.
class LampView {
public:
    virtual ~LampView() = default;
    /// How bright each lamp burns now, 1 = fully. Throws DeviceError.
    virtual std::vector<double> burning() const = 0;
};

}  // namespace darkbox::sim
