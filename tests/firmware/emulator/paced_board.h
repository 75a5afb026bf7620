#pragma once

#include <condition_variable>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <thread>

#include "acquisition/frame/units.h"
#include "tests/firmware/emulator/emulated_host.h"

namespace darkbox::test {

/// A transfer as the kernel is asked for it.
struct UsbRequest {
    std::uint8_t endpoint = 0;       ///< with its direction bit
    ControlRequest control;          ///< of endpoint 0
    std::vector<std::uint8_t> data;  ///< to send, or what came
    std::size_t wanted = 0;          ///< of an IN transfer
    int error = 0;                   ///< as the kernel tells it: 0, -EPIPE, -ENODEV …
    const void* owner = nullptr;     ///< the open file that it was given to
};

/// The emulated board and a bus around it, on a thread that keeps the chip's time at the wall clock's. It is enumerated
/// when it attaches, and again when it comes back from a reset. Thread-safe.
class PacedBoard {
public:
    PacedBoard(const std::filesystem::path& elf, const std::optional<lamp_protocol::Identity>& identity);
    PacedBoard(const PacedBoard&) = delete;
    PacedBoard& operator=(const PacedBoard&) = delete;
    ~PacedBoard();

    using RequestPtr = std::shared_ptr<UsbRequest>;
    void submit(const RequestPtr& request);
    /// False when it is over already.
    bool discard(const RequestPtr& request);
    /// Its owner is gone: nobody will take it, whether it is over or not.
    void drop(const RequestPtr& request);
    /// Waits for a transfer of this owner to be over, but not longer; the first that was not taken yet.
    RequestPtr take_ended(const void* owner, std::chrono::microseconds patience);

    /// Does it on the board's thread, and waits until it is done.
    void with_board(const std::function<void(EmulatedBoard&, EmulatedHost&)>& work);
    /// The cable: while it is pulled, no transfer succeeds, and the board is told nothing.
    void set_plugged(bool plugged);

    std::vector<std::uint8_t> device_descriptor;
    std::vector<std::uint8_t> configuration_descriptor;
    /// May change what a host gets to a request, on the board's thread: a board that is not as it should be.
    std::function<void(const ControlRequest&, std::vector<std::uint8_t>&)> alter_answer;
    /// Whether the camera's strobe line is up at a moment of CLOCK_MONOTONIC; asked on the board's thread, as its time
    /// goes.
    std::function<bool(TimePoint)> strobe_line;
    /// Of CLOCK_MONOTONIC: where the chip's time has got to; on the board's thread.
    TimePoint board_time() const;
    /// How far the chip's time ever was behind the wall clock's on a busy machine, which a real chip's never is; on the
    /// board's thread.
    std::chrono::nanoseconds worst_lateness() const { return worst_lateness_; }
    /// Called on the board's thread when it went away by a reset, and when it is back.
    std::function<void(bool present)> on_presence;

private:
    void run();
    void enumerate();
    void catch_up();
    void follow_strobe();
    void watch_presence();
    bool serve();
    bool attempt(UsbRequest& request);
    void fail_all(int error);
    void end(const RequestPtr& request);

    EmulatedBoard board_;
    EmulatedHost host_{board_};
    std::mutex mutex_;
    std::condition_variable something_to_do_;
    std::condition_variable something_ended_;
    std::list<RequestPtr> waiting_;          ///< guarded by mutex_
    std::list<RequestPtr> ended_;            ///< guarded by mutex_
    std::list<std::function<void()>> work_;  ///< guarded by mutex_
    bool plugged_ = true;                    ///< guarded by mutex_
    bool ends_ = false;                      ///< guarded by mutex_
    bool present_ = true;
    unsigned resets_seen_ = 0;
    bool strobe_up_ = false;
    std::chrono::steady_clock::time_point wall_start_;
    std::uint64_t cycle_start_ = 0;
    std::chrono::nanoseconds worst_lateness_{0};
    std::thread thread_;
};

}  // namespace darkbox::test
