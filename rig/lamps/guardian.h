#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "acquisition/device/clock.h"
#include "rig/lamps/gpio_lines.h"
#include "rig/lamps/guardian_packets.h"

namespace darkbox {

/// The one that holds the lamps' lines, and obeys the daemon at the other end of a channel. It darkens them, and goes
/// on holding them dark, when a lamp was lit for too long or nothing was heard for `silence`; then it lights nothing
/// until it was told to darken. Where the chip fails to darken a lamp, it is owed darkness: its lines are requested
/// anew, which darkens them, until that succeeds. Who owns it waits for the channel, never longer than
/// milliseconds_left(). Thread-compatible.
class Guardian {
public:
    Guardian(const RequestLines& request_lines, Nanoseconds silence)
        : request_lines_(request_lines), silence_(silence) {}
    Guardian(const Guardian&) = delete;
    Guardian& operator=(const Guardian&) = delete;
    /// Darkens; tries for ten seconds where the chip fails.
    ~Guardian();

    /// Takes one packet from the channel and answers it. False: the channel is closed, or that was no packet.
    bool hear(int channel);
    /// The daemon is gone: dark, and held so.
    void darken() noexcept;
    /// Until something is to be done without a command: darken, or try to once more; -1: the lamps are dark.
    int milliseconds_left() const;
    void darken_when_overdue();

private:
    void open(const GpioRequest& request);
    void repay() noexcept;
    void obey(const GuardianCommand& command);
    void drive(const GuardianCommand& command);
    void need_lines() const;
    void set(std::uint64_t step);
    void darken_or_throw();
    TimePoint overdue_at() const;
    [[noreturn]] void refuse_forced() const;

    const RequestLines& request_lines_;
    const Nanoseconds silence_;
    SystemClock clock_;
    std::shared_ptr<const GpioRequest> request_ = std::make_shared<const GpioRequest>();
    std::shared_ptr<const GpioRequest> owed_;  ///< may have a lamp lit, and is not held
    std::unique_ptr<OutputLines> lines_;
    std::uint64_t lit_ = 0;  ///< the step that is on; 0: dark
    TimePoint lit_until_;
    TimePoint heard_;
    std::string forced_;  ///< why the guardian darkened the lamps; empty: it did not
};

}  // namespace darkbox
