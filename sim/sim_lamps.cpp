#include "sim/sim_lamps.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "acquisition/device/device_error.h"

namespace darkbox::sim {
namespace {

/// The call before the first: what burns of its own from the start.
constexpr std::uint64_t before_any_call = 0;

/// Light of pulses with a duty of one half, over the light of their mean. From the clock's origin to t the pulses have
/// shone for half of every whole period, and for all of the rest up to half a period.
double pulsed_share(const Interval& interval, double hertz) {
    const auto shone_until = [&](TimePoint moment) {
        const double periods = to_seconds(moment.time_since_epoch()) * hertz;
        return 0.5 * std::floor(periods) + std::min(periods - std::floor(periods), 0.5);
    };
    const double periods = to_seconds(interval.end - interval.begin) * hertz;
    return 2.0 * (shone_until(interval.end) - shone_until(interval.begin)) / periods;
}

}  // namespace

SimLamps::SimLamps(std::size_t count, const SimClock& clock, FaultPlan faults)
    : count_(count), clock_(clock), faults_(std::move(faults)) {
    history_.push_back({clock_.now(), really_burning({}, before_any_call)});
}

SimLamps::~SimLamps() = default;

void SimLamps::check(LampId lamp, double level) const {
    if (lamp.value >= count_)
        throw DeviceError(fmt::format("lamp {} does not exist: the simulated rig has {}", lamp.value, count_),
                          "number lamps from 0 in the order of rig.toml");
    if (!(level > 0.0 && level <= 1.0))
        throw DeviceError(fmt::format("lamp {}: level {} is not in (0, 1]", lamp.value, level),
                          "use dark() to switch off");
}

void SimLamps::catch_up() const {
    if (catch_up_) catch_up_();
}

void SimLamps::light(LampId lamp, double level) {
    check(lamp, level);
    catch_up();
    next_step_ = program_.size();
    command(clock_.now(), {{lamp, level}});
}

LampHealth SimLamps::health() {
    constexpr double room_c = 24;
    return {.temperature_c = faults_.amount(FaultKind::hot_lamps, switches()).value_or(room_c)};
}

void SimLamps::dark() {
    catch_up();
    next_step_ = program_.size();
    command(clock_.now(), {});
}

void SimLamps::arm(const std::vector<StrobeStep>& program, Nanoseconds /*exposed*/) {
    for (const StrobeStep& step : program)
        if (step.lamp) check(*step.lamp, step.level);
    dark();
    events_.clear();
    program_ = program;
    next_step_ = 0;
}

void SimLamps::strobe(TimePoint moment) {
    if (next_step_ == program_.size()) return;
    const StrobeStep& step = program_[next_step_];
    command(moment, step.lamp ? std::vector<LampShare>{{*step.lamp, step.level}} : std::vector<LampShare>{});
    events_.push_back({next_step_++, {moment, moment}});
}

std::vector<StrobeEvent> SimLamps::take_events() {
    catch_up();
    return std::exchange(events_, {});
}

void SimLamps::command(TimePoint when, std::vector<LampShare> commanded) {
    history_.push_back({when, really_burning(std::move(commanded), switches())});
}

std::vector<LampShare> SimLamps::really_burning(std::vector<LampShare> burning, std::uint64_t call) const {
    for (const Fault& fault : faults_.faults) {
        if (call < fault.at) continue;
        if (fault.kind == FaultKind::dead_lamp)
            std::erase_if(burning, [&](const LampShare& b) { return b.lamp == fault.lamp; });
        if (fault.kind == FaultKind::stuck_lamp &&
            std::none_of(burning.begin(), burning.end(), [&](const LampShare& b) { return b.lamp == fault.lamp; }))
            burning.push_back({fault.lamp, 1.0});
        const auto lit =
            std::find_if(burning.begin(), burning.end(), [&](const LampShare& b) { return b.lamp == fault.lamp; });
        if (fault.kind == FaultKind::dim_lamp && lit != burning.end()) lit->share *= fault.amount;
        if (fault.kind == FaultKind::leaking_lamp && lit != burning.end())
            burning.push_back({fault.other, fault.amount * lit->share});
        if (fault.kind == FaultKind::swapped_lamps)
            for (LampShare& b : burning)
                b.lamp = b.lamp == fault.lamp ? fault.other : b.lamp == fault.other ? fault.lamp : b.lamp;
    }
    return burning;
}

std::vector<LampShare> SimLamps::burning_during(const Interval& interval) const {
    auto burning = sim::burning_during(history_, interval);
    if (const auto hertz = faults_.amount(FaultKind::pwm, switches()))
        for (LampShare& b : burning) b.share *= pulsed_share(interval, *hertz);
    return burning;
}

}  // namespace darkbox::sim
