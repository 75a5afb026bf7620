#include "rig/lamps/usb_lamps.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "acquisition/device/device_error.h"
#include "rig/lamps/thermistor.h"

namespace darkbox {

using namespace lamp_protocol;

namespace {

constexpr double full_level = 255.0;

LampControllerOptions options_of(const RigDescription& rig) {
    LampControllerOptions options;
    options.serial = rig.usb.serial;
    options.heartbeat = to_nanoseconds(rig.usb.heartbeat);
    return options;
}

/// The share of a long time that a lamp may shine is cooling / (64 + cooling); rounded to the safe side.
std::uint8_t cooling_of(double duty) {
    return static_cast<std::uint8_t>(std::clamp(std::floor(64.0 * duty / (1.0 - duty)), 1.0, 255.0));
}

std::uint8_t level_of(double level) {
    if (!(level > 0.0 && level <= 1.0)) throw std::invalid_argument(fmt::format("level {} is not in (0, 1]", level));
    return static_cast<std::uint8_t>(std::clamp(std::lround(level * full_level), 1L, 255L));
}

std::uint32_t step_time(Nanoseconds time) {
    const auto us = std::chrono::duration_cast<std::chrono::microseconds>(time).count();
    if (us < 0 || us > longest_time_us)
        throw std::invalid_argument(fmt::format("a step of {} us; allowed: up to {}", us, longest_time_us));
    return static_cast<std::uint32_t>(us);
}

}  // namespace

UsbLamps::UsbLamps(const RigDescription& rig) : UsbLamps(rig, options_of(rig)) {}

UsbLamps::UsbLamps(const RigDescription& rig, LampControllerOptions options) : controller_(std::move(options)) {
    for (const LampDescription& lamp : rig.lamps) {
        Channel channel;
        channel.name = lamp.name;
        channel.output = static_cast<std::uint8_t>(lamp.channel);
        channel.limit = {channel.output, 1, 0, cooling_of(lamp.max_duty), {}};
        channel.limit.max_on_ms = static_cast<std::uint16_t>(
            std::clamp(std::floor(lamp.max_on.count() * 1000.0), 1.0, static_cast<double>(longest_on_ms)));
        channels_.push_back(channel);
    }
    check(rig);
    set_up();
}

UsbLamps::~UsbLamps() = default;

void UsbLamps::check(const RigDescription& rig) const {
    const Info info = controller_.info();
    for (std::size_t i = 0; i < channels_.size(); ++i) {
        const Channel& channel = channels_[i];
        if (info.lamps != 0 && channel.output >= info.lamps)
            throw InputError(fmt::format("lamp '{}' is on channel {}, but the lamp controller has channels 0 to {}",
                                         channel.name, channel.output, info.lamps - 1),
                             "correct channel in rig.toml, or store another identity in the board");
        if (info.lamps != 0 && rig.lamps[i].max_on.count() * 1000.0 > info.most_on_ms)
            throw InputError(fmt::format("max_on_s of '{}' is {}, but the lamp controller allows up to {}",
                                         channel.name, rig.lamps[i].max_on.count(), info.most_on_ms / 1000.0),
                             "lower max_on_s in rig.toml");
    }
}

/// What the board forgets with every reset.
void UsbLamps::set_up() {
    const auto heartbeat = std::chrono::duration_cast<std::chrono::milliseconds>(controller_.options().heartbeat);
    controller_.command(Command::configure, ConfigureCommand{static_cast<std::uint16_t>(heartbeat.count()), 1, 0});
    for (const Channel& channel : channels_) controller_.command(Command::limit, channel.limit);
}

void UsbLamps::light(LampId lamp, double level) {
    if (lamp.value >= channels_.size())
        throw std::invalid_argument(fmt::format("lamp {} of {}", lamp.value, channels_.size()));
    const std::uint8_t output = channels_[lamp.value].output;
    LightCommand light{};
    light.lamps[output / 8] = static_cast<std::uint8_t>(1U << output % 8);
    light.level = level_of(level);
    if (stepping_) dark();
    try {
        controller_.command(Command::light, light);
        lit_ = true;
    } catch (const DeviceError&) {
        loss_told_ = controller_.gone();
        throw;
    }
}

void UsbLamps::dark() {
    stepping_ = false;
    if (darken()) {
        lit_ = false;
        return;
    }
    controller_.reconnect();  // one that was unplugged, reset or hung, and comes back dark
    set_up();
    const bool interrupted = std::exchange(lit_, false);
    const bool told = std::exchange(loss_told_, false);
    if (interrupted && !told)
        throw DeviceError("the lamp controller was lost while a lamp was lit, and came back dark",
                          "check its cable and its supply");
}

/// False when the board cannot be reached.
bool UsbLamps::darken() {
    try {
        controller_.command(Command::dark);
        const Status status = controller_.status();
        if (status.activity != Activity::dark) return false;
        if (status.faults != 0) controller_.command(Command::clear_faults, ClearCommand{status.faults, {}});
        return true;
    } catch (const DeviceError&) {
        if (!controller_.gone() && is_dark()) throw;  // it says why it will not light again
        return false;
    }
}

bool UsbLamps::is_dark() {
    try {
        return controller_.status().activity == Activity::dark;
    } catch (const DeviceError&) {
        return false;
    }
}

LampHealth UsbLamps::health() {
    try {
        const Status status = controller_.status();
        return {.reachable = true,
                .problems = faults_in_words(status.faults),
                .temperature_c = celsius_of_thermistor(status.temperature)};
    } catch (const Error& error) {
        return {.reachable = false, .problems = {error.what()}};
    }
}

Step UsbLamps::step_of(const LampStep& wanted) const {
    if (wanted.lamp && wanted.lamp->value >= channels_.size())
        throw std::invalid_argument(fmt::format("lamp {} of {}", wanted.lamp->value, channels_.size()));
    Step step{};
    step.lamp_and_mode = wanted.lamp ? channels_[wanted.lamp->value].output : channels_.front().output;
    step.level = wanted.lamp ? level_of(wanted.level) : std::uint8_t{0};
    if (wanted.trigger) step.lamp_and_mode |= step_trigger;
    if (wanted.wait_for_strobe) step.lamp_and_mode |= step_wait_strobe;
    write_24(step.lead_us, step_time(wanted.lead));
    write_24(step.exposure_us, step_time(wanted.exposure));
    return step;
}

void UsbLamps::run_program(const std::vector<LampStep>& wanted, std::uint16_t rounds) {
    if (wanted.empty() || wanted.size() > most_steps)
        throw std::invalid_argument(fmt::format("a program of {} steps; allowed: 1 to {}", wanted.size(), most_steps));
    std::vector<Step> steps;
    for (const LampStep& step : wanted) steps.push_back(step_of(step));
    for (std::size_t first = 0; first < steps.size(); first += steps_per_packet) {
        const std::size_t count = std::min<std::size_t>(steps_per_packet, steps.size() - first);
        LampBytes payload{static_cast<std::uint8_t>(first), static_cast<std::uint8_t>(count), 0, 0};
        const auto* bytes = reinterpret_cast<const std::uint8_t*>(&steps[first]);
        payload.insert(payload.end(), bytes, bytes + count * sizeof(Step));
        controller_.command(Command::write_steps, std::span<const std::uint8_t>(payload));
    }
    RunProgramCommand run{};
    run.count = static_cast<std::uint8_t>(steps.size());
    run.rounds = rounds;
    run.crc = crc16(steps.data(), steps.size() * sizeof(Step));
    controller_.forget_events();
    events_lost_before_ = controller_.events_lost();
    controller_.command(Command::run_program, run);
}

/// None at the deadline.
std::optional<LampEvent> UsbLamps::program_event(TimePoint deadline) {
    auto event = controller_.next_event(deadline);
    if (controller_.events_lost() != events_lost_before_)
        throw DeviceError("the lamp controller lost events of its program", "run it again");
    if (!event && controller_.gone())
        throw DeviceError("the lamp controller is gone", "check its cable and its supply");
    if (event && event->raw.kind == EventKind::fault)
        throw DeviceError(
            fmt::format("the lamps' program ended: {}", fmt::join(faults_in_words(event->raw.code), "; ")),
            "see docs/lamp-controller.md");
    return event;
}

LampStepDone UsbLamps::step_done(const LampEvent& event) const {
    if (!event.when)
        throw DeviceError("the lamp controller's clock was never compared with this host's", "connect it again");
    const Event& raw = event.raw;
    LampStepDone done;
    done.step = raw.detail;
    done.round = raw.round;
    for (std::uint32_t i = 0; i < channels_.size(); ++i)
        if (channels_[i].output == raw.lamp) done.lamp = LampId{i};
    done.exposure.begin = event.when->time;
    done.exposure.end = event.when->time + std::chrono::microseconds(raw.value);
    done.uncertainty = event.when->uncertainty;
    return done;
}

std::optional<LampStepDone> UsbLamps::next_step_done(TimePoint deadline) {
    const auto event = program_event(deadline);
    if (!event)
        throw DeadlineError("no step of the lamps' program was over before the deadline", "check the camera's strobe");
    if (event->raw.kind == EventKind::program_done) return std::nullopt;
    return step_done(*event);
}

void UsbLamps::arm(const std::vector<StrobeStep>& program, Nanoseconds exposed) {
    if (program.empty() || program.size() > longest_program || program.back().lamp)
        throw std::invalid_argument(fmt::format("a strobed program of 1 to {} steps must end dark", longest_program));
    // The board steps at the end of an exposure: that of the dark one lights the program's first lamp.
    std::vector<LampStep> steps{{.lamp = {}, .exposure = exposed, .wait_for_strobe = true}};
    for (const StrobeStep& step : std::span(program).first(program.size() - 1))
        steps.push_back({.lamp = step.lamp, .level = step.level, .exposure = exposed, .wait_for_strobe = true});
    dark();
    lit_ = stepping_ = true;
    run_program(steps);
}

std::vector<StrobeEvent> UsbLamps::take_events() {
    std::vector<StrobeEvent> made;
    try {
        while (stepping_) {
            const auto event = program_event({});
            if (!event) break;
            if (event->raw.kind == EventKind::program_done) {
                stepping_ = false;
            } else {
                const LampStepDone done = step_done(*event);
                made.push_back(
                    {done.step, {done.exposure.end - done.uncertainty, done.exposure.end + done.uncertainty}});
            }
        }
    } catch (const DeviceError&) {
        loss_told_ = controller_.gone();
        throw;
    }
    return made;
}

}  // namespace darkbox
