#include "firmware/lampctl/program.h"

namespace darkbox {
namespace lampctl {

using lamp_protocol::read_24;

namespace {

/// Later than this the board takes up the time anew, or it would hurry through what it missed.
constexpr uint32_t hopelessly_late_us = 1000;

}  // namespace

void Program::start(uint8_t count, uint16_t rounds, uint32_t at_us) {
    count_ = count;
    rounds_ = rounds;
    place_ = 0;
    round_ = 0;
    phase_ = Phase::starting;
    deadline_us_ = at_us;
}

void Program::begin_step(uint32_t at_us) {
    phase_ = Phase::lead;
    deadline_us_ = at_us + read_24(current().lead_us);
}

void Program::begin_exposure(uint32_t at_us) {
    phase_ = Phase::exposure;
    begin_us_ = at_us;
    deadline_us_ = at_us + read_24(current().exposure_us);
}

bool Program::end_lead() {
    if ((current().lamp_and_mode & lamp_protocol::step_wait_strobe) != 0) {
        phase_ = Phase::strobe;
        return false;
    }
    begin_exposure(deadline_us_);
    return true;
}

bool Program::strobe(uint32_t at_us) {
    if (phase_ != Phase::strobe) return false;
    begin_exposure(at_us);
    return true;
}

Program::Finished Program::end_exposure(uint32_t now_us) {
    const Finished finished{place_, round_, begin_us_, deadline_us_ - begin_us_};
    const uint32_t next = now_us - deadline_us_ > hopelessly_late_us ? now_us : deadline_us_;
    ++place_;
    if (place_ == count_) {
        place_ = 0;
        ++round_;
        if (round_ == rounds_) {
            phase_ = Phase::idle;
            return finished;
        }
    }
    begin_step(next);
    return finished;
}

}  // namespace lampctl
}  // namespace darkbox
