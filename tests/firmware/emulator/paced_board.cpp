#include "tests/firmware/emulator/paced_board.h"

#include <algorithm>
#include <cerrno>
#include <future>

namespace darkbox::test {
namespace {

using Handshake = EmulatedBoard::Handshake;
using std::chrono::steady_clock;

constexpr double slice_us = 100;
/// Of a chip that is behind: its bus is looked after less often.
constexpr std::uint64_t longer_slice_us = 500;
constexpr auto idle_nap = std::chrono::microseconds(500);
constexpr auto hopelessly_late = std::chrono::milliseconds(100);

int error_of(Handshake handshake) {
    switch (handshake) {
        case Handshake::ack:
            return 0;
        case Handshake::stall:
            return -EPIPE;
        case Handshake::nak:
            return -ETIMEDOUT;
        default:
            return -EPROTO;
    }
}

}  // namespace

PacedBoard::PacedBoard(const std::filesystem::path& elf, const std::optional<lamp_protocol::Identity>& identity)
    : board_(elf, identity) {
    enumerate();
    device_descriptor = host_.control({0x80, 6, 0x0100, 0, 18}).bytes;
    configuration_descriptor = host_.control({0x80, 6, 0x0200, 0, 255}).bytes;
    thread_ = std::thread([this] { run(); });
}

PacedBoard::~PacedBoard() {
    {
        const std::lock_guard lock(mutex_);
        ends_ = true;
    }
    something_to_do_.notify_all();
    thread_.join();
}

void PacedBoard::enumerate() {
    host_.enumerate();
    resets_seen_ = board_.resets();
}

void PacedBoard::submit(const RequestPtr& request) {
    const std::lock_guard lock(mutex_);
    waiting_.push_back(request);
    something_to_do_.notify_all();
}

bool PacedBoard::discard(const RequestPtr& request) {
    const std::lock_guard lock(mutex_);
    const auto found = std::find(waiting_.begin(), waiting_.end(), request);
    if (found == waiting_.end()) return false;
    request->error = -ENOENT;
    waiting_.erase(found);
    end(request);
    return true;
}

void PacedBoard::drop(const RequestPtr& request) {
    const std::lock_guard lock(mutex_);
    waiting_.remove(request);
    ended_.remove(request);
}

void PacedBoard::end(const RequestPtr& request) {
    ended_.push_back(request);
    something_ended_.notify_all();
}

PacedBoard::RequestPtr PacedBoard::take_ended(const void* owner, std::chrono::microseconds patience) {
    std::unique_lock lock(mutex_);
    auto found = ended_.end();
    const auto some = [&] {
        found = std::find_if(ended_.begin(), ended_.end(), [&](const RequestPtr& r) { return r->owner == owner; });
        return found != ended_.end();
    };
    if (!something_ended_.wait_for(lock, patience, some)) return nullptr;
    RequestPtr request = *found;
    ended_.erase(found);
    return request;
}

void PacedBoard::with_board(const std::function<void(EmulatedBoard&, EmulatedHost&)>& work) {
    std::promise<void> done;
    {
        const std::lock_guard lock(mutex_);
        work_.push_back([&] {
            work(board_, host_);
            done.set_value();
        });
    }
    something_to_do_.notify_all();
    done.get_future().wait();
}

void PacedBoard::set_plugged(bool plugged) {
    with_board([&](EmulatedBoard&, EmulatedHost&) {
        {
            const std::lock_guard lock(mutex_);
            plugged_ = plugged;
        }
        if (plugged)
            enumerate();
        else
            fail_all(-ENODEV);
    });
}

void PacedBoard::fail_all(int error) {
    const std::lock_guard lock(mutex_);
    for (const RequestPtr& request : waiting_) {
        request->error = error;
        end(request);
    }
    waiting_.clear();
}

/// Tries a transfer once; true when it is over.
bool PacedBoard::attempt(UsbRequest& request) {
    if (request.endpoint == 0 || request.endpoint == 0x80) {
        const auto answer = host_.control(request.control, request.data);
        request.error = error_of(answer.handshake);
        if ((request.control.type & 0x80) != 0) request.data = answer.bytes;
        if (alter_answer) alter_answer(request.control, request.data);
        return true;
    }
    const std::uint8_t number = request.endpoint & 0x0F;
    Handshake result;
    if ((request.endpoint & 0x80) != 0)
        result = board_.in(number, request.data);
    else
        result = board_.out(number, request.data.data(), static_cast<std::uint32_t>(request.data.size()));
    if (result == Handshake::nak) return false;
    request.error = error_of(result);
    return true;
}

/// True when something went on.
bool PacedBoard::serve() {
    std::list<RequestPtr> requests;
    {
        const std::lock_guard lock(mutex_);
        if (waiting_.empty() || !plugged_ || !present_) return false;
        requests = waiting_;
    }
    std::vector<std::uint8_t> busy;
    bool progress = false;
    for (const RequestPtr& request : requests) {
        if (std::find(busy.begin(), busy.end(), request->endpoint) != busy.end()) continue;
        busy.push_back(request->endpoint);
        if (!attempt(*request)) continue;
        const std::lock_guard lock(mutex_);
        const auto found = std::find(waiting_.begin(), waiting_.end(), request);
        if (found == waiting_.end()) continue;
        waiting_.erase(found);
        end(request);
        progress = true;
    }
    return progress;
}

void PacedBoard::watch_presence() {
    if (present_ && board_.resets() != resets_seen_) {
        present_ = false;
        fail_all(-ENODEV);
        if (on_presence) on_presence(false);
    }
    if (board_.in_bootloader()) board_.brown_out();  // whoever programs it starts it again: here, at once
    if (present_ || !board_.attached()) return;
    enumerate();
    present_ = true;
    if (on_presence) on_presence(true);
}

TimePoint PacedBoard::board_time() const {
    const auto since = std::chrono::nanoseconds((board_.cycle() - cycle_start_) * 1000 / EmulatedBoard::cycles_per_us);
    return TimePoint((wall_start_ + since).time_since_epoch());
}

void PacedBoard::follow_strobe() {
    const bool up = strobe_line && strobe_line(board_time());
    if (up != strobe_up_) board_.set_strobe(up);
    strobe_up_ = up;
}

void PacedBoard::catch_up() {
    const auto wall = steady_clock::now() - wall_start_;
    const auto due = cycle_start_ + static_cast<std::uint64_t>(std::chrono::nanoseconds(wall).count()) * 16 / 1000;
    worst_lateness_ =
        std::max(worst_lateness_, wall - std::chrono::nanoseconds((board_.cycle() - cycle_start_) * 1000 / 16));
    if (board_.cycle() < due) {
        follow_strobe();
        const bool behind = board_.cycle() + longer_slice_us * EmulatedBoard::cycles_per_us < due;
        board_.run_us(behind ? static_cast<double>(longer_slice_us) : slice_us);
    }
    if (board_.cycle() + std::chrono::nanoseconds(hopelessly_late).count() * 16 / 1000 < due) {
        wall_start_ = steady_clock::now();
        cycle_start_ = board_.cycle();
    }
}

void PacedBoard::run() {
    wall_start_ = steady_clock::now();
    cycle_start_ = board_.cycle();
    for (;;) {
        std::list<std::function<void()>> work;
        {
            const std::lock_guard lock(mutex_);
            if (ends_) return;
            work.swap(work_);
        }
        for (const auto& one : work) one();
        const bool progress = serve();
        catch_up();
        watch_presence();
        const auto ahead = static_cast<std::int64_t>(board_.cycle() - cycle_start_) * 1000 / 16 -
                           std::chrono::nanoseconds(steady_clock::now() - wall_start_).count();
        if (progress || ahead < 0) continue;
        std::unique_lock lock(mutex_);
        if (work_.empty() && !ends_) something_to_do_.wait_for(lock, idle_nap);
    }
}

}  // namespace darkbox::test
