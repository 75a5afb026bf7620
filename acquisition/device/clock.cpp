#include "acquisition/device/clock.h"

#include <cerrno>
#include <ctime>

namespace darkbox {
namespace {

constexpr Nanoseconds::rep nanoseconds_per_second = 1'000'000'000;

}  // namespace

TimePoint SystemClock::now() const {
    timespec t{};
    ::clock_gettime(CLOCK_MONOTONIC, &t);
    return TimePoint(Nanoseconds(t.tv_sec * nanoseconds_per_second + t.tv_nsec));
}

void SystemClock::sleep_until(TimePoint moment) {
    const auto ns = moment.time_since_epoch().count();
    const timespec t{ns / nanoseconds_per_second, ns % nanoseconds_per_second};
    while (::clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, nullptr) == EINTR) {
    }
}

}  // namespace darkbox
