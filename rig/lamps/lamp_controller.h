#pragma once

#include <condition_variable>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "rig/lamps/device_clock.h"
#include "rig/lamps/lamp_packets.h"
#include "rig/lamps/usb_link.h"

namespace darkbox {

struct LampControllerOptions {
    std::string serial;                               ///< empty: the only board there is
    Nanoseconds heartbeat = std::chrono::seconds(1);  ///< silence after which the board darkens its lamps; 50 ms to 1 s
    Nanoseconds patience = std::chrono::milliseconds(500);  ///< for one transfer, or a reply
    Nanoseconds replug_patience = std::chrono::seconds(5);  ///< for a board that is gone to come back
};

/// What the board tells by itself, in the host's time.
struct LampEvent {
    lamp_protocol::Event raw;
    std::optional<DeviceClock::Mapped> when;
};

/// One lamp controller on USB: commands with their replies, a heartbeat from a thread of its own, events in the order
/// in which they came. A board that stalls is cleared and asked again, once; one that was reset, unplugged or flashed
/// is waited for by its serial in reconnect(). Thread-safe, but for reconnect(), which nobody else may use the board
/// during.
class LampController {
public:
    /// Opens the board, refuses another version in words, and darkens it. Throws DeviceError.
    explicit LampController(LampControllerOptions options);
    LampController(const LampController&) = delete;
    LampController& operator=(const LampController&) = delete;
    ~LampController();

    /// Opens it anew, waiting for it; dark, its faults cleared where that is allowed.
    void reconnect();
    bool gone() const;

    lamp_protocol::Info info() const;
    lamp_protocol::Identity identity() const;
    lamp_protocol::Status status() const;

    /// The reply. Throws DeviceError when there is none, and for every outcome other than done.
    lamp_protocol::Event command(lamp_protocol::Command name, std::span<const std::uint8_t> payload = {});
    template <typename Payload>
    lamp_protocol::Event command(lamp_protocol::Command name, const Payload& payload) {
        return command(name, std::span<const std::uint8_t>(lamp_payload(payload)));
    }
    /// By endpoint 0: works while commands are stuck.
    void dark_by_request();
    void store_identity(const lamp_protocol::Identity& identity);
    void start_bootloader();

    /// The next event that is no reply; none at the deadline, or when the board is gone.
    std::optional<LampEvent> next_event(TimePoint deadline);
    void forget_events();
    /// Events that the board could not deliver, by the gaps in their numbers.
    std::uint64_t events_lost() const;

    const LampControllerOptions& options() const { return options_; }

private:
    void connect(UsbBus::Handle handle);
    void check_version();
    void on_packet(std::span<const std::uint8_t> packet);
    lamp_protocol::Event exchange(lamp_protocol::Command name, std::span<const std::uint8_t> payload);
    lamp_protocol::Event wait_for_reply(std::uint8_t sequence, TimePoint sent);
    void beat();
    UsbLink& link() const;

    LampControllerOptions options_;
    UsbBus bus_;
    std::unique_ptr<UsbLink> link_;
    lamp_protocol::Info info_{};

    std::mutex commands_;        ///< one command is under way at a time
    std::uint8_t sequence_ = 0;  ///< guarded by commands_

    mutable std::mutex state_;
    std::condition_variable changed_;
    std::optional<lamp_protocol::Event> reply_;  ///< guarded by state_
    std::uint8_t awaited_ = 0;                   ///< guarded by state_
    std::deque<LampEvent> events_;               ///< guarded by state_
    std::optional<std::uint8_t> last_number_;    ///< guarded by state_
    std::uint64_t events_lost_ = 0;              ///< guarded by state_
    DeviceClock clock_;                          ///< guarded by state_
    bool ends_ = false;                          ///< guarded by state_
    std::thread heart_;
};

}  // namespace darkbox
