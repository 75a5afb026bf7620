#pragma once

#include <sys/types.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <span>
#include <thread>
#include <vector>

#include "acquisition/device/unique_fd.h"
#include "acquisition/frame/units.h"
#include "rig/lamps/gpio_lines.h"
#include "rig/lamps/guardian_packets.h"
#include "rig/lamps/guardian_socket.h"

namespace darkbox {

struct GuardianOptions {
    Nanoseconds silence = std::chrono::seconds(1);  ///< the daemon is taken for hung after this
    Nanoseconds beat_every = std::chrono::milliseconds(100);
    Nanoseconds reply_within = std::chrono::seconds(2);
};

/// The daemon's side of the guardian: the process that holds the lamps' lines and darkens them when the daemon dies or
/// hangs (guardian.h says when). The lines are requested by open(), as often as need be, so a chip may come later or
/// come back. When the guardian dies, the lines are requested here, which darkens them, and nothing is lit any more.
/// Thread-safe.
class LampGuardian {
public:
    /// A guardian of its own. Forks, so it must run before any thread starts.
    LampGuardian(GpioRequest request, RequestLines request_lines, GuardianOptions options = {});
    /// The guardian that runs by itself; `request_lines` is for when it dies.
    LampGuardian(GpioRequest request, RequestLines request_lines, GuardianConnection guardian,
                 GuardianOptions options = {});
    LampGuardian(const LampGuardian&) = delete;
    LampGuardian& operator=(const LampGuardian&) = delete;
    /// The lamps are dark when it returns, and a guardian of its own is gone.
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
    using Packet = std::span<const std::byte>;
    enum class Aim { dark, other };

    void tell(Packet packet, Aim aim);
    void send(Packet packet);
    GuardianReply receive();
    void beat(const std::stop_token& stop);
    [[noreturn]] void give_up();
    [[noreturn]] void take_over();

    const GpioRequest request_;
    const GuardianOpening opening_;
    const RequestLines request_lines_;
    const GuardianOptions options_;
    std::mutex mutex_;
    UniqueFd channel_;                    // guarded by mutex_
    std::unique_ptr<OutputLines> taken_;  // guarded by mutex_; held dark since the guardian died
    pid_t pid_ = -1;
    bool own_ = false;   // a child, to be waited for
    std::jthread beat_;  // last: ends before what it uses
};

}  // namespace darkbox
