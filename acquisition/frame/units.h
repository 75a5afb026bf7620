#pragma once

#include <chrono>

namespace darkbox {

/// A duration as people write it. Durations are never bare numbers; a bare number carries its unit in its name.
using Seconds = std::chrono::duration<double>;
using Nanoseconds = std::chrono::nanoseconds;

/// The one clock of a capture: CLOCK_MONOTONIC on a real rig, virtual time on the simulated one.
/// It has no now(): only an acquisition/device Clock tells the time.
struct MonotonicTime {
    using rep = Nanoseconds::rep;
    using period = Nanoseconds::period;
    using duration = Nanoseconds;
    using time_point = std::chrono::time_point<MonotonicTime>;
    static constexpr bool is_steady = true;
};
using TimePoint = MonotonicTime::time_point;

/// [begin, end) on the capture's clock.
struct Interval {
    TimePoint begin;
    TimePoint end;
    bool contains(const Interval& inner) const { return begin <= inner.begin && inner.end <= end; }
};

constexpr Nanoseconds to_nanoseconds(Seconds s) { return std::chrono::duration_cast<Nanoseconds>(s); }
constexpr double to_seconds(Nanoseconds d) { return Seconds(d).count(); }
constexpr double to_milliseconds(Nanoseconds d) { return to_seconds(d) * 1000.0; }

}  // namespace darkbox
