#pragma once

#include <cstdint>
#include <deque>
#include <optional>

#include "acquisition/frame/units.h"

namespace darkbox {

/// The host's time of a moment that a device stamped with its own microseconds. Each exchange tells that a stamp lies
/// between sending and receiving; the tightest of the last ones counts, and loses with its age what two crystals may
/// drift apart. Thread-compatible.
class DeviceClock {
public:
    static constexpr double drift = 100e-6;  ///< of both crystals together
    static constexpr std::size_t exchanges_kept = 64;

    struct Mapped {
        TimePoint time;
        Nanoseconds uncertainty;  ///< either way
    };

    /// `stamp_us` was taken between the two moments.
    void exchange(TimePoint sent, TimePoint received, std::uint32_t stamp_us);
    /// A stamp at most half an hour from the last exchange: its 32 bits wrap. None before the first exchange.
    std::optional<Mapped> map(std::uint32_t stamp_us) const;
    /// The device started anew: what was known of its clock is void.
    void forget() { exchanges_.clear(); }

private:
    struct Exchange {
        TimePoint middle;
        Nanoseconds half_width;
        std::uint32_t stamp_us;
    };
    std::deque<Exchange> exchanges_;
};

}  // namespace darkbox
