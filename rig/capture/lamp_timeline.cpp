#include "rig/capture/lamp_timeline.h"

#include <algorithm>

namespace darkbox {
namespace {

/// Frames are asked about within a queue's length of their exposure.
constexpr std::size_t states_kept = 256;

}  // namespace

Nanoseconds LampTimeline::settle_of(std::optional<LampId> lamp) const {
    return lamp ? settle_.at(lamp->value) : Nanoseconds(0);
}

void LampTimeline::switched(const Interval& call, std::optional<LampId> lamp) {
    const std::optional<LampId> before = states_.empty() ? std::nullopt : states_.back().lamp;
    if (lamp == before) return;
    TimePoint steady = call.end + std::max(settle_of(lamp), settle_of(before));
    if (!states_.empty()) steady = std::max(steady, states_.back().steady);
    states_.push_back({call, lamp, steady});
    if (states_.size() > states_kept) states_.pop_front();
}

std::optional<LampTimeline::Light> LampTimeline::sole_light(const Interval& exposure, Nanoseconds margin) const {
    const Interval wide{exposure.begin - margin, exposure.end + margin};
    TimePoint until = TimePoint::max();
    for (auto state = states_.rbegin(); state != states_.rend(); ++state) {
        if (state->steady <= wide.begin && wide.end <= until) return Light{state->lamp, state->call.end};
        if (state->call.begin <= wide.begin) return std::nullopt;
        until = state->call.begin;
    }
    const bool forgotten = states_.size() == states_kept;
    if (forgotten || wide.end > until) return std::nullopt;
    return Light{std::nullopt, TimePoint::min()};
}

double LampTimeline::share(LampId lamp, const Interval& interval) const {
    Nanoseconds lit{0};
    TimePoint until = interval.end;
    for (auto state = states_.rbegin(); state != states_.rend(); ++state) {
        const TimePoint from = state->call.begin + (state->call.end - state->call.begin) / 2;
        if (state->lamp == lamp && from < until)
            lit += std::max(Nanoseconds(0), until - std::max(from, interval.begin));
        until = std::min(until, std::max(from, interval.begin));
    }
    return to_seconds(lit) / to_seconds(interval.end - interval.begin);
}

TimePoint LampTimeline::steady_from() const { return states_.empty() ? TimePoint::min() : states_.back().steady; }

}  // namespace darkbox
