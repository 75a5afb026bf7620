// The lamp controller's image that is flashed, emulated, as a USB device of full speed in a port of the kernel's
// virtual USB host. SIGUSR1 pulls its cable, SIGUSR2 plugs it in again, SIGHUP hangs the firmware.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <map>
#include <optional>

#include "acquisition/frame/error.h"
#include "firmware/board/host/host_board.h"
#include "sim/bridge/shared_line.h"
#include "sim/bridge/usbip_port.h"
#include "tests/firmware/emulator/paced_board.h"

namespace darkbox::test {
namespace {

using std::chrono::milliseconds;

constexpr auto control_patience = milliseconds(2000);
/// The kernel takes a while to see that a port is empty.
constexpr auto free_port_patience = std::chrono::seconds(5);

struct Orders {
    std::atomic<bool> pull = false;
    std::atomic<bool> plug = false;
    std::atomic<bool> hang = false;
    std::atomic<bool> leave = false;
};
Orders orders;

void on_signal(int number) {
    if (number == SIGUSR1)
        orders.pull = true;
    else if (number == SIGUSR2)
        orders.plug = true;
    else if (number == SIGHUP)
        orders.hang = true;
    else
        orders.leave = true;
}

/// Endpoint 0 is answered by the firmware, whatever is asked.
class BoardFunction final : public sim::UsbFunction {
public:
    explicit BoardFunction(PacedBoard& board) : board_(board) {}

    sim::UsbSpeed speed() const override { return sim::UsbSpeed::full; }
    std::optional<sim::UsbBytes> control(const sim::UsbRequest& r, std::span<const std::uint8_t> data) override {
        const auto request = std::make_shared<UsbRequest>();
        request->control = {r.type, r.request, r.value, r.index, r.length};
        request->data.assign(data.begin(), data.end());
        request->owner = this;
        board_.submit(request);
        const auto ended = board_.take_ended(this, control_patience);
        if (!ended) board_.drop(request);
        if (!ended || ended->error != 0) return std::nullopt;
        return ended->data;
    }

private:
    PacedBoard& board_;
};

/// A board in a port: what the host waits for is given to the board, what it took back is taken from it.
class PluggedBoard {
public:
    PluggedBoard(PacedBoard& board, Clock& clock, int port)
        : board_(board), clock_(clock), function_(board), port_(function_, clock, port) {}
    PluggedBoard(const PluggedBoard&) = delete;
    PluggedBoard& operator=(const PluggedBoard&) = delete;
    ~PluggedBoard() {
        for (const auto& [id, request] : given_) board_.drop(request);
    }

    void turn() {
        port_.serve(clock_.now() + milliseconds(1));
        const auto& waiting = port_.waiting();
        std::erase_if(given_, [&](const auto& given) {
            const bool waited_for =
                std::any_of(waiting.begin(), waiting.end(), [&](const auto& t) { return t.id == given.first; });
            if (!waited_for) board_.drop(given.second);
            return !waited_for;
        });
        for (const sim::UsbTransfer& transfer : waiting)
            if (given_.count(transfer.id) == 0) give(transfer);
        while (const auto ended = board_.take_ended(this, std::chrono::microseconds(0))) finish(ended);
    }
    bool host_is_gone() const { return port_.host_is_gone(); }

private:
    void give(const sim::UsbTransfer& transfer) {
        const auto request = std::make_shared<UsbRequest>();
        request->endpoint = transfer.endpoint;
        request->data = transfer.data;
        request->wanted = transfer.length;
        request->owner = this;
        given_[transfer.id] = request;
        board_.submit(request);
    }
    void finish(const PacedBoard::RequestPtr& ended) {
        const auto found =
            std::find_if(given_.begin(), given_.end(), [&](const auto& given) { return given.second == ended; });
        if (found == given_.end()) return;
        port_.finish(found->first, ended->error, ended->error == 0 ? ended->data : sim::UsbBytes());
        given_.erase(found);
    }

    PacedBoard& board_;
    Clock& clock_;
    BoardFunction function_;
    sim::UsbIpPort port_;
    std::map<std::uint32_t, PacedBoard::RequestPtr> given_;
};

struct BoardArguments {
    std::filesystem::path elf;
    std::filesystem::path seen;
    std::filesystem::path strobe;
    std::string serial = "LC-HIL";
    int port = 1;
};

lamp_protocol::Identity identity_of(const BoardArguments& a) {
    lamp_protocol::Identity identity = lampctl::HostBoard::some_identity();
    identity.most_on_ms = lamp_protocol::longest_on_ms;
    std::memset(identity.serial, 0, sizeof identity.serial);
    std::memcpy(identity.serial, a.serial.data(), std::min(a.serial.size(), sizeof identity.serial));
    identity.crc = lamp_protocol::crc16(&identity, offsetof(lamp_protocol::Identity, crc));
    return identity;
}

/// Plugged in while the firmware is attached to the bus and the cable is in.
class Cable {
public:
    Cable(PacedBoard& board, Clock& clock, int port) : board_(board), clock_(clock), port_(port) {
        board_.with_board([this](EmulatedBoard&, EmulatedHost&) {
            board_.on_presence = [this](bool present) { present_ = present; };
        });
    }
    Cable(const Cable&) = delete;
    Cable& operator=(const Cable&) = delete;
    ~Cable() {
        board_.with_board([this](EmulatedBoard&, EmulatedHost&) { board_.on_presence = {}; });
    }

    void turn() {
        if (orders.pull.exchange(false)) {
            in_ = false;
            plugged_.reset();
            board_.set_plugged(false);
        }
        if (orders.plug.exchange(false)) {
            board_.set_plugged(true);
            in_ = true;
        }
        if (orders.hang.exchange(false))
            board_.with_board([](EmulatedBoard& chip, EmulatedHost&) { chip.hang(EmulatedBoard::Interrupts::served); });
        const bool wanted = in_ && present_;
        if (plugged_ && (!wanted || plugged_->host_is_gone())) plugged_.reset();
        if (wanted && !plugged_) plug_in();
        if (plugged_)
            plugged_->turn();
        else
            clock_.sleep_for(milliseconds(5));
    }

private:
    void plug_in() {
        const TimePoint end = clock_.now() + free_port_patience;
        for (;;) {
            try {
                plugged_.emplace(board_, clock_, port_);
                return;
            } catch (const Error&) {
                if (clock_.now() >= end) throw;
            }
            clock_.sleep_for(milliseconds(50));
        }
    }

    PacedBoard& board_;
    Clock& clock_;
    int port_;
    std::atomic<bool> present_{true};
    bool in_ = true;
    std::optional<PluggedBoard> plugged_;
};

double board_seconds(PacedBoard& board) {
    double seconds = 0;
    board.with_board([&](EmulatedBoard& chip, EmulatedHost&) { seconds = chip.now_us() * 1e-6; });
    return seconds;
}

void serve_board(const BoardArguments& a) {
    SystemClock clock;
    std::optional<sim::SharedLine> strobe;
    if (!a.strobe.empty()) strobe.emplace(a.strobe);
    std::ofstream(a.seen) << "0 0 0\n";
    PacedBoard board(a.elf, identity_of(a));
    board.with_board([&](EmulatedBoard& chip, EmulatedHost&) {
        chip.on_lamps = [&](const LampsSeen& lamps) {
            std::ofstream(a.seen, std::ios::app)
                << fmt::format("{} {:x} {}\n", clock.now().time_since_epoch().count(), lamps.lit, lamps.level);
        };
        if (strobe) board.strobe_line = [&](TimePoint) { return strobe->is_up(); };
    });
    for (const int number : {SIGINT, SIGTERM, SIGUSR1, SIGUSR2, SIGHUP}) std::signal(number, on_signal);
    const TimePoint start = clock.now();
    const double start_s = board_seconds(board);
    {
        Cable cable(board, clock, a.port);
        while (!orders.leave) cable.turn();
    }
    fmt::print("{:.1f} s of the board's time in {:.1f} s\n", board_seconds(board) - start_s,
               to_seconds(clock.now() - start));
}

int parse_and_serve(int argc, char** argv) {
    BoardArguments a;
    CLI::App app("The emulated lamp controller in a port of the kernel's virtual USB host", "usb_lamp_board");
    app.add_option("--elf", a.elf, "The image that is flashed")->required();
    app.add_option("--seen", a.seen, "File to which it writes which lamps burn")->required();
    app.add_option("--strobe", a.strobe, "File that is the camera's strobe line");
    app.add_option("--serial", a.serial, "The board's, up to 12 characters");
    app.add_option("--port", a.port, "Of the virtual USB host, 0 to 7");
    CLI11_PARSE(app, argc, argv);
    serve_board(a);
    return 0;
}

}  // namespace
}  // namespace darkbox::test

int main(int argc, char** argv) {
    try {
        return darkbox::test::parse_and_serve(argc, argv);
    } catch (const darkbox::Error& error) {
        fmt::print(stderr, "usb_lamp_board: error: {}\n  {}\n", error.what(), error.hint());
    } catch (const std::exception& error) {
        fmt::print(stderr, "usb_lamp_board: error: {}\n", error.what());
    }
    return 1;
}
