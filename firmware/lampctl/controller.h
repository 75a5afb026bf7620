#pragma once

#include <stdint.h>

#include "firmware/lampctl/budgets.h"
#include "firmware/lampctl/event_queue.h"
#include "firmware/lampctl/outputs.h"
#include "firmware/lampctl/program.h"
#include "firmware/protocol/lamp_protocol.h"

namespace darkbox {
namespace lampctl {

/// The lamp controller without its board: takes commands, runs programs, and darkens the lamps when the host falls
/// silent, a budget is used up, the board is too hot or the strobe stays out. It starts dark. Times are the board's
/// microseconds, which wrap. Thread-hostile: a board calls it with interrupts off.
class Controller {
public:
    explicit Controller(Outputs& outputs) : outputs_(outputs) {}

    /// What the board was told it is. Dark, and nothing lights while it is not valid.
    void identify(const lamp_protocol::Identity& identity);

    /// Whether a packet is whole and known; takes long, and needs no protection from interrupts.
    static lamp_protocol::Outcome check(const uint8_t* packet, uint8_t size);
    /// Does what a packet says and queues the reply. `checked` is what check() said of it.
    void execute(const uint8_t* packet, uint8_t size, lamp_protocol::Outcome checked, uint32_t now_us);

    /// Once a millisecond.
    void tick(uint32_t now_us);
    /// When advance() is to be called next, if `waits()`.
    uint32_t deadline_us() const { return program_.deadline_us(); }
    bool waits() const { return program_.has_deadline(); }
    /// Does what is due.
    void advance(uint32_t now_us);
    /// The strobe input rose.
    void strobe(uint32_t at_us);
    /// A reading of the thermistor, 0 to 1023, lower is hotter.
    void temperature(uint16_t reading, uint32_t now_us);
    /// The bus was reset, suspended or unplugged, or the configuration taken back. What waited for the host is void.
    void host_gone(uint32_t now_us);
    void dark();

    EventQueue& events() { return events_; }
    lamp_protocol::Status status(uint32_t now_us) const;
    lamp_protocol::Info info() const;
    bool is_dark() const { return lit_.empty() && !program_.running(); }

private:
    struct Reply {
        lamp_protocol::Outcome outcome;
        uint8_t detail;
        uint32_t value;
    };

    Reply obey(lamp_protocol::Command command, const uint8_t* payload, uint32_t now_us);
    Reply light(const uint8_t* payload);
    Reply configure(const uint8_t* payload);
    Reply limit(const uint8_t* payload);
    Reply clear(const uint8_t* payload);
    Reply write_steps(const uint8_t* payload);
    Reply run_program(const uint8_t* payload, uint32_t now_us);
    Reply check_step(uint8_t place) const;

    void show(const LampSet& lamps, uint8_t level);
    void show_step(uint32_t now_us);
    void end_step(uint32_t now_us);
    void fault(uint8_t which, uint8_t lamp, uint32_t now_us);
    void watch_host(uint32_t now_us);
    void watch_strobe(uint32_t now_us);

    Outputs& outputs_;
    Budgets budgets_;
    Program program_;
    EventQueue events_;
    LampSet lit_;
    uint8_t level_ = 0;
    uint8_t faults_ = lamp_protocol::fault_identity;
    uint8_t lamps_ = 0;
    uint8_t most_lit_of_board_ = 0;
    uint8_t most_lit_ = 1;
    uint16_t most_on_ms_ = 0;
    uint16_t hot_ = 0;
    uint16_t heartbeat_ms_ = lamp_protocol::longest_heartbeat_ms;
    uint16_t silence_ms_ = 0;
    uint16_t temperature_ = 0;
    uint8_t hot_readings_ = 0;
    uint8_t missing_readings_ = 0;
};

}  // namespace lampctl
}  // namespace darkbox
