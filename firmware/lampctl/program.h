#pragma once

#include <stdint.h>

#include "firmware/lampctl/outputs.h"
#include "firmware/protocol/lamp_protocol.h"

namespace darkbox {
namespace lampctl {

/// The uploaded steps and where in them the board is. It keeps the time of the steps; what is lit is the controller's.
/// Times are microseconds of a clock that wraps; each deadline is counted from the one before, so that lateness does
/// not add up.
class Program {
public:
    enum class Phase : uint8_t { idle, starting, lead, strobe, exposure };

    struct Finished {
        uint8_t step;
        uint16_t round;
        uint32_t begin_us;
        uint32_t exposure_us;
    };

    void write(uint8_t place, const lamp_protocol::Step& step) { steps_[place] = step; }
    uint16_t crc(uint8_t count) const { return lamp_protocol::crc16(steps_, count * sizeof(lamp_protocol::Step)); }
    const lamp_protocol::Step& step(uint8_t place) const { return steps_[place]; }

    /// begin() is due at that moment.
    void start(uint8_t count, uint16_t rounds, uint32_t at_us);
    /// The first step begins.
    void begin() { begin_step(deadline_us_); }
    void stop() { phase_ = Phase::idle; }
    bool running() const { return phase_ != Phase::idle; }
    Phase phase() const { return phase_; }
    uint8_t place() const { return place_; }
    const lamp_protocol::Step& current() const { return steps_[place_]; }

    /// When something is due; meaningless while idle, and while the strobe is waited for.
    uint32_t deadline_us() const { return deadline_us_; }
    bool has_deadline() const { return phase_ != Phase::idle && phase_ != Phase::strobe; }
    bool due(uint32_t now_us) const { return has_deadline() && static_cast<int32_t>(now_us - deadline_us_) >= 0; }

    /// The lead is over: the exposure begins, or the strobe is waited for. Returns whether it begins.
    bool end_lead();
    /// The strobe rose at this moment; true when the exposure begins with it.
    bool strobe(uint32_t at_us);
    /// The exposure is over, at its deadline; goes on to the next step, or idle after the last round.
    Finished end_exposure(uint32_t now_us);

private:
    void begin_step(uint32_t at_us);
    void begin_exposure(uint32_t at_us);

    lamp_protocol::Step steps_[lamp_protocol::most_steps] = {};
    Phase phase_ = Phase::idle;
    uint8_t place_ = 0;
    uint8_t count_ = 0;
    uint16_t round_ = 0;
    uint16_t rounds_ = 0;
    uint32_t begin_us_ = 0;
    uint32_t deadline_us_ = 0;
};

}  // namespace lampctl
}  // namespace darkbox
