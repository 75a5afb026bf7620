#include "rig/capture/exposure_clock.h"

#include <algorithm>
#include <cmath>

namespace darkbox {
namespace {

constexpr std::size_t places_kept = 32;
constexpr int strangers_for_a_new_rhythm = 3;
/// A camera's real rate and the one it tells differ by less.
constexpr double period_tolerance = 0.05;
/// What a stamp may miss the rhythm by, as a share of the period, besides what its like have missed it by.
constexpr double stamp_tolerance = 0.02;
/// Resolution of V4L2's stamps, and what a kernel takes to make them.
constexpr double least_margin_ns = 20'000;

double ns(Nanoseconds d) { return static_cast<double>(d.count()); }
Nanoseconds rounded(double d) { return Nanoseconds(static_cast<Nanoseconds::rep>(std::llround(d))); }

}  // namespace

ExposureClock::ExposureClock(const CameraInfo& camera, std::optional<MeasuredTiming> measured)
    : nominal_period_(camera.frame_period.count() * 1e9), measured_(measured), period_(nominal_period_) {}

void ExposureClock::restart() {
    places_.clear();
    strangers_ = 0;
    period_ = nominal_period_;
    offset_ = worst_off_ = 0;
    end_from_stamp_ = Nanoseconds::min();
}

double ExposureClock::off(const Place& place) const {
    const double frames = static_cast<double>(place.sequence) - static_cast<double>(origin_.sequence);
    return ns(place.stamp - origin_.stamp) - offset_ - period_ * frames;
}

Nanoseconds ExposureClock::tolerance() const { return rounded(stamp_tolerance * nominal_period_ + 3 * worst_off_); }

bool ExposureClock::follow(const Frame& frame) {
    const Place place{frame.sequence, frame.timestamp};
    const bool later =
        places_.empty() || (place.sequence > places_.back().sequence && place.stamp > places_.back().stamp);
    const bool keeps = later && (!locked() || std::abs(off(place)) <= ns(tolerance()));
    if (!keeps && ++strangers_ < strangers_for_a_new_rhythm) return false;
    if (!keeps) restart();
    strangers_ = 0;
    begin_from_stamp_ = frame.exposure.begin - frame.timestamp;
    // A driver that tells an upper bound cuts it off at the present.
    end_from_stamp_ = std::max(end_from_stamp_, frame.exposure.end - frame.timestamp);
    places_.push_back(place);
    if (places_.size() > places_kept) places_.pop_front();
    fit();
    return keeps;
}

/// Least squares; the slope stays near the period that the camera tells.
void ExposureClock::fit() {
    origin_ = places_.front();
    double n = 0, x = 0, y = 0, xx = 0, xy = 0;
    for (const Place& place : places_) {
        const auto dx = static_cast<double>(place.sequence - origin_.sequence);
        const double dy = ns(place.stamp - origin_.stamp) - nominal_period_ * dx;
        n += 1;
        x += dx;
        y += dy;
        xx += dx * dx;
        xy += dx * dy;
    }
    const double spread = xx - x * x / n;
    const double limit = period_tolerance * nominal_period_;
    const double slope = spread > 0 ? std::clamp((xy - x * y / n) / spread, -limit, limit) : 0.0;
    period_ = nominal_period_ + slope;
    offset_ = (y - slope * x) / n;
    worst_off_ = 0;
    for (const Place& place : places_) worst_off_ = std::max(worst_off_, std::abs(off(place)));
}

Nanoseconds ExposureClock::margin() const {
    // Few stamps may all be late by chance; many show how late they get.
    const double few = 1.2 + 12.0 / static_cast<double>(std::max<std::size_t>(places_.size(), 1));
    return rounded(few * worst_off_ + least_margin_ns) + (measured_ ? measured_->margin : Nanoseconds(0));
}

Nanoseconds ExposureClock::doubt() const {
    return locked() || places_.size() < wanted_places ? Nanoseconds(0) : std::min(margin(), rounded(nominal_period_));
}

Interval ExposureClock::exposure_of(const Frame& frame) const {
    if (!measured_) return frame.exposure;
    return {frame.timestamp + measured_->begin_from_stamp, frame.timestamp + measured_->end_from_stamp};
}

TimePoint ExposureClock::stamp(std::uint64_t sequence) const {
    const double frames = static_cast<double>(sequence) - static_cast<double>(origin_.sequence);
    return origin_.stamp + rounded(offset_ + period_ * frames);
}

Interval ExposureClock::predicted(std::uint64_t sequence) const {
    const TimePoint stamped = stamp(sequence);
    return {stamped + (measured_ ? measured_->begin_from_stamp : begin_from_stamp_),
            stamped + (measured_ ? measured_->end_from_stamp : end_from_stamp_)};
}

std::uint64_t ExposureClock::first_from(TimePoint moment) const {
    const double frames = ns(moment - predicted(origin_.sequence).begin) / period_;
    return origin_.sequence + static_cast<std::uint64_t>(std::max(0.0, std::ceil(frames)));
}

}  // namespace darkbox
