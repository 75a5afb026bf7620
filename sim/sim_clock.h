#pragma once

#include <atomic>

#include "acquisition/device/clock.h"

namespace darkbox::sim {

/// The twin's time. Virtual: stands still but for sleep_until(), which moves it forward at once; it starts at 1 s.
/// Real: the system's clock. Thread-safe.
class SimClock final : public Clock {
public:
    enum class Pace { virtual_time, real_time };
    explicit SimClock(Pace pace = Pace::virtual_time) : pace_(pace) {}

    TimePoint now() const override {
        return pace_ == Pace::real_time ? system_.now() : TimePoint(Nanoseconds(virtual_now_.load()));
    }

    void sleep_until(TimePoint moment) override {
        if (pace_ == Pace::real_time) return system_.sleep_until(moment);
        const auto target = moment.time_since_epoch().count();
        auto current = virtual_now_.load();
        while (current < target && !virtual_now_.compare_exchange_weak(current, target)) {
        }
    }

private:
    Pace pace_;
    SystemClock system_;
    std::atomic<Nanoseconds::rep> virtual_now_{1'000'000'000};
};

}  // namespace darkbox::sim
