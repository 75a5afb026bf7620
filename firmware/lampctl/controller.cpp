#include "firmware/lampctl/controller.h"

#include <string.h>

#include "firmware/lampctl/identity.h"

namespace darkbox {
namespace lampctl {

using namespace lamp_protocol;

namespace {

constexpr uint16_t sensor_missing = 1010;  ///< readings above: nothing pulls the input down
constexpr uint16_t cooler_by = 40;         ///< readings above `hot` before the fault can be cleared
constexpr uint8_t readings_that_count = 4;

template <typename Payload>
Payload payload_as(const uint8_t* bytes) {
    Payload payload;
    memcpy(&payload, bytes, sizeof payload);
    return payload;
}

/// Of the payload; 0xFF for a command that is not known. write_steps is as long as its steps.
uint8_t payload_size(Command command, const uint8_t* payload, uint8_t size) {
    switch (command) {
        case Command::heartbeat:
        case Command::dark:
            return 0;
        case Command::light:
            return sizeof(LightCommand);
        case Command::configure:
            return sizeof(ConfigureCommand);
        case Command::limit:
            return sizeof(LimitCommand);
        case Command::clear_faults:
            return sizeof(ClearCommand);
        case Command::write_steps: {
            const uint8_t head = offsetof(WriteStepsCommand, steps);
            if (size < head || payload[1] > steps_per_packet) return head + sizeof(Step);
            return static_cast<uint8_t>(head + payload[1] * sizeof(Step));
        }
        case Command::run_program:
            return sizeof(RunProgramCommand);
    }
    return 0xFF;
}

}  // namespace

Outcome Controller::check(const uint8_t* packet, uint8_t size) {
    if (size < sizeof(CommandHeader) || size > largest_packet) return Outcome::bad_length;
    const CommandHeader header = payload_as<CommandHeader>(packet);
    if (packet_crc(packet, size) != header.crc) return Outcome::bad_crc;
    const uint8_t payload = static_cast<uint8_t>(size - sizeof(CommandHeader));
    const uint8_t wanted = payload_size(header.command, packet + sizeof(CommandHeader), payload);
    if (wanted == 0xFF) return Outcome::unknown_command;
    return wanted == payload ? Outcome::done : Outcome::bad_length;
}

void Controller::execute(const uint8_t* packet, uint8_t size, Outcome checked, uint32_t now_us) {
    Reply reply{checked, 0, 0};
    if (checked == Outcome::done) {
        silence_ms_ = 0;
        reply = obey(payload_as<CommandHeader>(packet).command, packet + sizeof(CommandHeader), now_us);
    }
    Event event = {};
    event.kind = EventKind::reply;
    event.sequence = size >= 2 ? packet[1] : 0;
    event.code = static_cast<uint8_t>(reply.outcome);
    event.time_us = now_us;
    event.value = reply.value;
    event.detail = reply.detail;
    event.lamp = no_lamp;
    events_.push(event);
}

Controller::Reply Controller::obey(Command command, const uint8_t* payload, uint32_t now_us) {
    if (command == Command::heartbeat) return {Outcome::done, 0, 0};
    if (command == Command::dark) {
        dark();
        return {Outcome::done, 0, 0};
    }
    if (program_.running()) return {Outcome::program_runs, program_.place(), 0};
    switch (command) {
        case Command::light:
            return light(payload);
        case Command::configure:
            return configure(payload);
        case Command::limit:
            return limit(payload);
        case Command::clear_faults:
            return clear(payload);
        case Command::write_steps:
            return write_steps(payload);
        default:
            return run_program(payload, now_us);
    }
}

Controller::Reply Controller::light(const uint8_t* payload) {
    const LightCommand command = payload_as<LightCommand>(payload);
    LampSet wanted;
    memcpy(wanted.bits, command.lamps, sizeof wanted.bits);
    if (faults_ != 0) return {Outcome::fault_stands, faults_, 0};
    if (command.level == 0) return {Outcome::out_of_range, offsetof(LightCommand, level), 0};
    if (wanted.empty()) return {Outcome::out_of_range, offsetof(LightCommand, lamps), 0};
    if (!wanted.within(lamps_)) return {Outcome::no_such_lamp, 0, 0};
    if (wanted.count() > most_lit_) return {Outcome::too_many_lit, most_lit_, 0};
    for (uint8_t lamp = 0; lamp < lamps_; ++lamp)
        if (wanted.has(lamp) && !lit_.has(lamp) && !budgets_.may_light(lamp))
            return {Outcome::lamp_rests, lamp, budgets_.rest_ms(lamp)};
    show(wanted, command.level);
    return {Outcome::done, 0, 0};
}

Controller::Reply Controller::configure(const uint8_t* payload) {
    const ConfigureCommand command = payload_as<ConfigureCommand>(payload);
    if (command.heartbeat_ms < shortest_heartbeat_ms || command.heartbeat_ms > longest_heartbeat_ms)
        return {Outcome::out_of_range, offsetof(ConfigureCommand, heartbeat_ms), 0};
    if (command.most_lit < 1 || command.most_lit > most_lit_of_board_)
        return {Outcome::out_of_range, offsetof(ConfigureCommand, most_lit), 0};
    if (lit_.count() > command.most_lit) dark();
    heartbeat_ms_ = command.heartbeat_ms;
    most_lit_ = command.most_lit;
    return {Outcome::done, 0, 0};
}

Controller::Reply Controller::limit(const uint8_t* payload) {
    const LimitCommand command = payload_as<LimitCommand>(payload);
    if (command.first >= lamps_) return {Outcome::no_such_lamp, 0, 0};
    if (command.count < 1 || command.count > lamps_ - command.first)
        return {Outcome::out_of_range, offsetof(LimitCommand, count), 0};
    if (command.max_on_ms < 1 || command.max_on_ms > most_on_ms_)
        return {Outcome::out_of_range, offsetof(LimitCommand, max_on_ms), 0};
    if (command.cooling < 1) return {Outcome::out_of_range, offsetof(LimitCommand, cooling), 0};
    for (uint8_t i = 0; i < command.count; ++i)
        budgets_.limit(static_cast<uint8_t>(command.first + i), command.max_on_ms, command.cooling);
    return {Outcome::done, 0, 0};
}

Controller::Reply Controller::clear(const uint8_t* payload) {
    uint8_t wanted = static_cast<uint8_t>(payload_as<ClearCommand>(payload).faults & ~fault_identity);
    if (temperature_ < hot_ + cooler_by) wanted = static_cast<uint8_t>(wanted & ~fault_too_hot);
    if (temperature_ > sensor_missing) wanted = static_cast<uint8_t>(wanted & ~fault_sensor);
    faults_ = static_cast<uint8_t>(faults_ & ~wanted);
    return {faults_ == 0 ? Outcome::done : Outcome::fault_stands, faults_, 0};
}

Controller::Reply Controller::write_steps(const uint8_t* payload) {
    const uint8_t first = payload[offsetof(WriteStepsCommand, first)];
    const uint8_t count = payload[offsetof(WriteStepsCommand, count)];
    if (count < 1 || count > steps_per_packet) return {Outcome::out_of_range, offsetof(WriteStepsCommand, count), 0};
    if (first > most_steps - count) return {Outcome::out_of_range, offsetof(WriteStepsCommand, first), 0};
    for (uint8_t i = 0; i < count; ++i)
        program_.write(static_cast<uint8_t>(first + i),
                       payload_as<Step>(payload + offsetof(WriteStepsCommand, steps) + i * sizeof(Step)));
    return {Outcome::done, 0, 0};
}

Controller::Reply Controller::check_step(uint8_t place) const {
    const Step& step = program_.step(place);
    const uint8_t lamp = step.lamp_and_mode & step_lamp;
    const uint32_t exposure = read_24(step.exposure_us);
    if (lamp >= lamps_) return {Outcome::no_such_lamp, place, 0};
    if (exposure < shortest_exposure_us) return {Outcome::out_of_range, place, exposure};
    const uint32_t longest_us = budgets_.max_on_ms(lamp) * 1000UL;
    if (step.level != 0 && read_24(step.lead_us) + exposure + 1000 > longest_us)
        return {Outcome::step_too_long, place, longest_us};
    return {Outcome::done, 0, 0};
}

Controller::Reply Controller::run_program(const uint8_t* payload, uint32_t now_us) {
    const RunProgramCommand command = payload_as<RunProgramCommand>(payload);
    if (faults_ != 0) return {Outcome::fault_stands, faults_, 0};
    if (command.count < 1 || command.count > most_steps)
        return {Outcome::out_of_range, offsetof(RunProgramCommand, count), 0};
    if (command.rounds < 1) return {Outcome::out_of_range, offsetof(RunProgramCommand, rounds), 0};
    dark();  // what follows takes long, and nothing may be lit while the ticks wait
    if (program_.crc(command.count) != command.crc) return {Outcome::other_program, 0, 0};
    for (uint8_t place = 0; place < command.count; ++place) {
        const Reply reply = check_step(place);
        if (reply.outcome != Outcome::done) return reply;
    }
    program_.start(command.count, command.rounds, now_us + program_starts_after_us);
    return {Outcome::done, 0, 0};
}

void Controller::show(const LampSet& lamps, uint8_t level) {
    outputs_.show(lamps, level);  // first: what follows takes longer for some lamps than for others
    budgets_.switched(lit_, lamps);
    lit_ = lamps;
    level_ = level;
}

void Controller::show_step(uint32_t now_us) {
    const Step& step = program_.current();
    const uint8_t lamp = step.lamp_and_mode & step_lamp;
    LampSet wanted;
    if (step.level != 0) wanted.add(lamp);
    if (step.level != 0 && !lit_.has(lamp) && !budgets_.may_light(lamp)) {
        fault(fault_on_too_long, lamp, now_us);
        return;
    }
    show(wanted, step.level);
}

void Controller::dark() {
    program_.stop();
    outputs_.trigger(false);
    show(LampSet(), 0);
}

void Controller::advance(uint32_t now_us) {
    while (program_.due(now_us)) {
        if (program_.phase() == Program::Phase::starting) {
            program_.begin();
            show_step(now_us);
        } else if (program_.phase() == Program::Phase::exposure) {
            end_step(now_us);
        } else if (program_.end_lead() && (program_.current().lamp_and_mode & step_trigger) != 0) {
            outputs_.trigger(true);
        }
    }
}

void Controller::strobe(uint32_t at_us) {
    if (program_.strobe(at_us) && (program_.current().lamp_and_mode & step_trigger) != 0) outputs_.trigger(true);
}

void Controller::end_step(uint32_t now_us) {
    const uint8_t lamp = program_.current().lamp_and_mode & step_lamp;
    const bool was_lit = !lit_.empty();
    outputs_.trigger(false);
    const Program::Finished finished = program_.end_exposure(now_us);
    if (program_.running())
        show_step(now_us);
    else
        show(LampSet(), 0);
    Event event = {};
    event.kind = EventKind::step;
    event.time_us = finished.begin_us;
    event.value = finished.exposure_us;
    event.detail = finished.step;
    event.lamp = was_lit ? lamp : no_lamp;
    event.round = finished.round;
    events_.push(event);
    if (program_.running() || faults_ != 0) return;
    event.kind = EventKind::program_done;
    event.time_us = now_us;
    event.value = 0;
    event.lamp = no_lamp;
    events_.push(event);
}

void Controller::fault(uint8_t which, uint8_t lamp, uint32_t now_us) {
    dark();
    if ((faults_ & which) != 0) return;
    faults_ = static_cast<uint8_t>(faults_ | which);
    Event event = {};
    event.kind = EventKind::fault;
    event.code = which;
    event.time_us = now_us;
    event.lamp = lamp;
    events_.push(event);
}

void Controller::watch_host(uint32_t now_us) {
    if (is_dark()) {
        silence_ms_ = 0;
        return;
    }
    ++silence_ms_;
    if (silence_ms_ >= heartbeat_ms_) fault(fault_host_lost, no_lamp, now_us);
}

/// A lit lamp's budget bounds the wait for the strobe; a dark frame's wait is bounded here.
void Controller::watch_strobe(uint32_t now_us) {
    constexpr uint32_t longest_dark_wait_us = 10000000;
    if (program_.phase() == Program::Phase::strobe && now_us - program_.deadline_us() > longest_dark_wait_us)
        fault(fault_strobe, no_lamp, now_us);
}

void Controller::tick(uint32_t now_us) {
    advance(now_us);
    watch_host(now_us);
    watch_strobe(now_us);
    const uint8_t over = budgets_.tick(lit_);
    if (over == no_lamp) return;
    const bool waited = program_.phase() == Program::Phase::strobe;
    fault(waited ? fault_strobe : fault_on_too_long, over, now_us);
}

void Controller::temperature(uint16_t reading, uint32_t now_us) {
    temperature_ = reading;
    hot_readings_ = reading < hot_ ? static_cast<uint8_t>(hot_readings_ + 1) : 0;
    missing_readings_ = reading > sensor_missing ? static_cast<uint8_t>(missing_readings_ + 1) : 0;
    if (hot_readings_ >= readings_that_count) {
        hot_readings_ = 0;
        fault(fault_too_hot, no_lamp, now_us);
    }
    if (missing_readings_ >= readings_that_count) {
        missing_readings_ = 0;
        fault(fault_sensor, no_lamp, now_us);
    }
}

void Controller::host_gone(uint32_t now_us) {
    events_.clear();
    if (!is_dark()) fault(fault_host_lost, no_lamp, now_us);
}

void Controller::identify(const Identity& identity) {
    dark();
    const bool good = valid(identity);
    faults_ = static_cast<uint8_t>(good ? faults_ & ~fault_identity : faults_ | fault_identity);
    lamps_ = good ? identity.lamps : 0;
    most_lit_of_board_ = good ? identity.most_lit : 0;
    most_on_ms_ = good ? identity.most_on_ms : 0;
    hot_ = good ? identity.hot : 0;
    most_lit_ = 1;
    for (uint8_t lamp = 0; lamp < most_lamps; ++lamp) {
        const uint16_t most = most_on_ms_ < Budgets::max_on_at_start_ms ? most_on_ms_ : Budgets::max_on_at_start_ms;
        budgets_.limit(lamp, most, Budgets::cooling_at_start);
    }
}

Status Controller::status(uint32_t now_us) const {
    Status status = {};
    status.faults = faults_;
    status.activity = program_.running() ? Activity::program : lit_.empty() ? Activity::dark : Activity::lit;
    status.level = level_;
    status.step = program_.running() ? program_.place() : 0;
    status.time_us = now_us;
    memcpy(status.lit, lit_.bits, sizeof status.lit);
    status.temperature = temperature_;
    status.heartbeat_ms = heartbeat_ms_;
    status.events_lost = events_.lost();
    status.most_lit = most_lit_;
    return status;
}

Info Controller::info() const {
    Info info = {};
    info.magic = info_magic;
    info.protocol_major = version_major;
    info.protocol_minor = version_minor;
    info.lamps = lamps_;
    info.most_lit = most_lit_of_board_;
    info.steps = most_steps;
    info.most_on_ms = most_on_ms_;
    return info;
}

}  // namespace lampctl
}  // namespace darkbox
