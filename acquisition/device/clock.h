#pragma once

#include "acquisition/frame/units.h"

namespace darkbox {

/// The time of a capture. Real: CLOCK_MONOTONIC. Simulated: virtual, moved forward by sleep_until().
/// Thread-safe where the implementation says so.
class Clock {
public:
    virtual ~Clock() = default;
    virtual TimePoint now() const = 0;
    virtual void sleep_until(TimePoint moment) = 0;

    void sleep_for(Nanoseconds duration) { sleep_until(now() + duration); }
};

/// CLOCK_MONOTONIC, the clock V4L2 stamps its buffers with. Thread-safe.
class SystemClock final : public Clock {
public:
    TimePoint now() const override;
    void sleep_until(TimePoint moment) override;
};

}  // namespace darkbox
