#pragma once

#include <optional>

#include "rig/description/rig_description.h"
#include "rig/lamps/lamp_array.h"
#include "rig/lamps/lamp_guardian.h"

namespace darkbox {

/// The lines of a rig with driver "gpio". Direct wiring: line i is lamp i. Multiplexed: the enable line, then the
/// address lines, lowest bit first. The enable line comes first, so that it falls before the address changes where a
/// chip switches its lines one by one.
GpioRequest gpio_request(const RigDescription& rig);

/// Lamps on GPIO lines, held by a guardian. One lamp is dark before the next is lit; a decoder's address changes only
/// while its outputs are disabled. A lamp that burns longer than its max_on is darkened by the guardian, and so is
/// every lamp when this process dies or hangs.
class GpioLamps final : public LampArray {
public:
    /// Opens the lines, dark. The guardian was made from gpio_request(rig), and outlives this.
    GpioLamps(const RigDescription& rig, LampGuardian& guardian);
    GpioLamps(const GpioLamps&) = delete;
    GpioLamps& operator=(const GpioLamps&) = delete;
    ~GpioLamps() override;

    std::size_t size() const override { return lamps_.size(); }
    /// `level` is 1: a line is on or off. Throws std::invalid_argument for others and for a lamp that is not there.
    void light(LampId lamp, double level) override;
    /// Opens the lines anew, and thereby dark, where they cannot be set: a chip may have been unplugged and come back.
    void dark() override;
    LampHealth health() override;

private:
    struct Output {
        std::uint64_t address = 0;  ///< lines that choose the lamp while it is dark; none when wired directly
        std::uint64_t on = 0;       ///< lines that light it
        Nanoseconds max_on{0};
    };

    std::vector<std::uint64_t> steps_to_dark() const;

    LampGuardian& guardian_;
    std::vector<Output> lamps_;
    std::optional<LampId> lit_;
};

}  // namespace darkbox
