#pragma once

#include <filesystem>
#include <vector>

#include "acquisition/device/unique_fd.h"
#include "sim/bridge/lamp_view.h"

namespace darkbox::sim {

/// A break in the wiring between lines and lamps.
struct WiringFault {
    std::vector<std::size_t> cut;                              ///< lamps that never burn
    std::vector<std::pair<std::size_t, std::size_t>> swapped;  ///< pairs whose wires are exchanged
};

/// The lamps as wires see them: lamp i burns while line i of a gpio-sim chip is high, whoever drives it. Reads what the
/// kernel says in sysfs. Thread-compatible.
class LampLines final : public LampView {
public:
    /// `chip`: the chip's folder in sysfs. Throws DeviceError.
    LampLines(const std::filesystem::path& chip, std::size_t lamps, const WiringFault& fault);

    /// All dark while the chip is unplugged.
    std::vector<double> burning() const override;

private:
    std::vector<UniqueFd> line_of_lamp_;  ///< empty: a cut wire
};

}  // namespace darkbox::sim
