#pragma once

#include <sys/types.h>

#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "acquisition/device/unique_fd.h"
#include "acquisition/frame/units.h"
#include "rig/lamps/gpio_lines.h"
#include "rig/lamps/guardian_process.h"

namespace darkbox {

struct GuardianOptions {
    Nanoseconds silence = std::chrono::seconds(1);  ///< the daemon is taken for hung after this
    Nanoseconds beat_every = std::chrono::milliseconds(100);
    Nanoseconds reply_within = std::chrono::seconds(2);
};

/// The daemon's side of the guardian: the process that holds the lamps' lines and darkens them when the daemon dies or
/// hangs (guardian_process.h says when). The constructor forks, so it must run before any thread starts; the lines are
/// requested by open(), as often as need be, so a chip may come later or come back.
/// When the guardian dies, the lines are requested here, which darkens them, and nothing is lit any more.
/// Thread-safe.
class LampGuardian {
public:
    LampGuardian(GpioRequest request, RequestLines request_lines, GuardianOptions options = {});
    LampGuardian(const LampGuardian&) = delete;
    LampGuardian& operator=(const LampGuardian&) = delete;
    /// The lamps are dark and the guardian is gone when it returns.
    ~LampGuardian();

    /// Requests every line, inactive. Throws what RequestLines throws.
    void open();
    /// Sets the steps one after another; the last stays for `at_most`, counted from when the lines last were dark.
    void drive(const std::vector<std::uint64_t>& steps, Nanoseconds at_most);
    /// Sets the steps, then every line inactive.
    void darken(const std::vector<std::uint64_t>& steps = {});
    /// Throws DeviceError that says why, where the lines are not open or the guardian darkened them by itself.
    void report();

    pid_t process() const { return pid_; }

private:
    void tell(const GuardianCommand& command);
    void send(const GuardianCommand& command);
    GuardianReply receive();
    void beat(const std::stop_token& stop);
    [[noreturn]] void take_over();

    const GpioRequest request_;
    const RequestLines request_lines_;
    const GuardianOptions options_;
    std::mutex mutex_;
    UniqueFd channel_;                    // guarded by mutex_
    std::unique_ptr<OutputLines> taken_;  // guarded by mutex_; held dark since the guardian died
    pid_t pid_ = -1;
    std::jthread beat_;  // last: ends before what it uses
};

}  // namespace darkbox
