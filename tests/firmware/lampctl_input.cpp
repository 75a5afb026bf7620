#include "tests/firmware/lampctl_input.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <stdexcept>
#include <string>
#include <vector>

#include "firmware/board/host/host_board.h"

namespace darkbox::test {
namespace {

using namespace lamp_protocol;
using lampctl::HostBoard;
using lampctl::LampSet;

constexpr std::uint64_t tick_us = 1000;

/// What the board was told, and what it may therefore do. It reckons in its own way: exact lit time and exact cooling.
class Judge {
public:
    explicit Judge(HostBoard& board) : board_(board) {
        board_.on_show = [this](const LampSet& lamps, std::uint8_t level) { shown(lamps, level); };
        identified(HostBoard::some_identity());
    }
    Judge(const Judge&) = delete;
    Judge& operator=(const Judge&) = delete;

    void identified(const Identity& identity) {
        const bool good = crc16(&identity, offsetof(Identity, crc)) == identity.crc;
        known_ = good;
        lamps_ = good ? identity.lamps : 0;
        most_lit_ = 1;
        for (Lamp& lamp : all_) {
            settle(lamp);
            limit(lamp, std::min<std::uint64_t>(1000, identity.most_on_ms), 64);
        }
    }
    void accepted(const std::vector<std::uint8_t>& packet) {
        heard_us_ = board_.now_us();
        const auto command = static_cast<Command>(packet[0]);
        const std::uint8_t* payload = packet.data() + sizeof(CommandHeader);
        if (command == Command::dark) require(board_.lit().empty(), "lit after dark");
        if (command == Command::configure) {
            ConfigureCommand c;
            std::memcpy(&c, payload, sizeof c);
            most_lit_ = c.most_lit;
            heartbeat_us_ = c.heartbeat_ms * tick_us;
        }
        if (command == Command::limit) {
            LimitCommand c;
            std::memcpy(&c, payload, sizeof c);
            for (unsigned i = c.first; i < static_cast<unsigned>(c.first + c.count); ++i) {
                settle(all_.at(i));
                limit(all_.at(i), c.max_on_ms, c.cooling);
            }
        }
        check();
    }
    /// A packet that was whole, whatever came of it.
    void heard() { heard_us_ = board_.now_us(); }

    void check() {
        const LampSet& lit = board_.lit();
        const std::uint64_t now = board_.now_us();
        require(lit.count() <= most_lit_, "too many lamps lit");
        if (lit.empty()) return;
        require(known_ && lit.within(lamps_), "lit a lamp that is not there");
        require(now <= heard_us_ + heartbeat_us_ + tick_us, "lit for a silent host");
        for (Lamp& lamp : all_) {
            if (lamp.lit) settle(lamp);
            require(
                !lamp.lit || lamp.used_us <= static_cast<double>(lamp.max_on_us) || now <= lamp.limited_us + tick_us,
                "lit beyond its budget");
            require(!lamp.lit || now <= lamp.lit_since_us + std::max(lamp.max_on_us, lamp.max_on_before_us) ||
                        now <= lamp.limited_us + tick_us,
                    "lit too long at a stretch");
        }
    }
    static void require(bool holds, const char* what) {
        if (!holds) throw std::logic_error(what);
    }

private:
    struct Lamp {
        bool lit = false;
        std::uint64_t lit_since_us = 0;
        std::uint64_t settled_us = 0;
        double used_us = 0;
        double cooling = 1;  ///< microseconds regained in one of darkness
        std::uint64_t max_on_us = 0;
        std::uint64_t max_on_before_us = 0;
        std::uint64_t limited_us = 0;
    };

    void limit(Lamp& lamp, std::uint64_t max_on_ms, unsigned cooling) const {
        if (max_on_ms * tick_us < lamp.max_on_us) lamp.limited_us = board_.now_us();
        lamp.max_on_before_us = lamp.lit ? std::max(lamp.max_on_us, lamp.max_on_before_us) : 0;
        lamp.max_on_us = max_on_ms * tick_us;
        lamp.cooling = cooling / 64.0;
    }
    void settle(Lamp& lamp) const {
        const auto passed = static_cast<double>(board_.now_us() - lamp.settled_us);
        lamp.used_us = lamp.lit ? lamp.used_us + passed : std::max(0.0, lamp.used_us - passed * lamp.cooling);
        lamp.settled_us = board_.now_us();
    }
    void shown(const LampSet& lamps, std::uint8_t level) {
        require(lamps.empty() || level > 0, "lit at level 0");
        for (std::uint8_t i = 0; i < most_lamps; ++i) {
            Lamp& lamp = all_[i];
            if (lamp.lit == lamps.has(i)) continue;
            settle(lamp);
            lamp.lit = !lamp.lit;
            if (lamp.lit) lamp.lit_since_us = board_.now_us();
        }
    }

    HostBoard& board_;
    std::array<Lamp, most_lamps> all_{};
    bool known_ = false;
    std::uint8_t lamps_ = 0;
    unsigned most_lit_ = 1;
    std::uint64_t heartbeat_us_ = longest_heartbeat_ms * tick_us;
    std::uint64_t heard_us_ = 0;
};

/// Reads what to do next from the input; zeros after its end.
class Input {
public:
    Input(const std::uint8_t* bytes, std::size_t size) : bytes_(bytes), left_(size) {}
    bool empty() const { return left_ == 0; }
    std::uint8_t byte() {
        if (left_ == 0) return 0;
        --left_;
        return *bytes_++;
    }
    std::vector<std::uint8_t> some(std::size_t size) {
        std::vector<std::uint8_t> taken(std::min(size, left_));
        std::copy_n(bytes_, taken.size(), taken.begin());
        bytes_ += taken.size();
        left_ -= taken.size();
        return taken;
    }

private:
    const std::uint8_t* bytes_;
    std::size_t left_;
};

void correct_crc(std::vector<std::uint8_t>& packet) {
    if (packet.size() < sizeof(CommandHeader)) return;
    const std::uint16_t crc = packet_crc(packet.data(), packet.size());
    std::memcpy(packet.data() + offsetof(CommandHeader, crc), &crc, sizeof crc);
}

void deliver(HostBoard& board, Judge& judge, const std::vector<std::uint8_t>& packet) {
    board.fetch_events();
    board.events.clear();
    board.receive(packet);
    board.fetch_events();
    for (const Event& event : board.events) {
        if (event.kind != EventKind::reply) continue;
        const auto outcome = static_cast<Outcome>(event.code);
        if (outcome > Outcome::unknown_command) judge.heard();
        if (outcome == Outcome::done) judge.accepted(packet);
    }
}

/// Commands as an attacker would make them: right in form, any in content.
std::vector<std::uint8_t> shaped_packet(Input& input) {
    static constexpr Command commands[] = {Command::heartbeat,    Command::dark,        Command::light,
                                           Command::configure,    Command::limit,       Command::write_steps,
                                           Command::clear_faults, Command::run_program, Command::light};
    static constexpr std::size_t sizes[] = {0, 0, 12, 4, 8, 12, 4, 8, 12};
    const std::size_t which = input.byte() % std::size(commands);
    std::vector<std::uint8_t> payload = input.some(sizes[which]);
    payload.resize(sizes[which]);
    if (commands[which] == Command::light && which == 8) {  // one lamp: the most common case should come by
        const unsigned lamp = payload[0] % most_lamps;
        std::fill_n(payload.begin(), 8, std::uint8_t{0});
        payload[lamp / 8] = static_cast<std::uint8_t>(1U << lamp % 8);
    }
    if (commands[which] == Command::write_steps) payload[1] = 1;
    return lampctl::packet_of(commands[which], 0, payload.data(), payload.size());
}

/// Runs the steps that lie there: their CRC is what the board itself would say.
std::vector<std::uint8_t> run_steps(Input& input, const std::vector<Step>& steps) {
    RunProgramCommand run{};
    run.count = static_cast<std::uint8_t>(1 + input.byte() % most_steps);
    run.rounds = static_cast<std::uint16_t>(1 + input.byte());
    run.crc = crc16(steps.data(), run.count * sizeof(Step));
    return lampctl::packet_of(Command::run_program, 0, &run, sizeof run);
}

}  // namespace

void play_to_lampctl(const std::uint8_t* bytes, std::size_t size) {
    HostBoard board;
    Judge judge(board);
    std::vector<Step> steps(most_steps);
    Input input(bytes, size);
    while (!input.empty()) {
        const std::uint8_t what = input.byte();
        switch (what % 8) {
            case 0: {
                std::vector<std::uint8_t> packet = input.some(what / 8U * 2U + 1U);
                correct_crc(packet);
                deliver(board, judge, packet);
                break;
            }
            case 1:
                deliver(board, judge, input.some(what / 4U));
                break;
            case 2:
            case 3: {
                const std::vector<std::uint8_t> packet = shaped_packet(input);
                if (static_cast<Command>(packet[0]) == Command::write_steps && packet[4] < most_steps &&
                    board.status().activity != Activity::program)
                    std::memcpy(&steps[packet[4]], packet.data() + 8, sizeof(Step));
                deliver(board, judge, packet);
                break;
            }
            case 4:
                board.run_us(input.byte() * 7U + 1U);
                break;
            case 5: {
                for (unsigned ms = input.byte(); ms > 0; --ms) {
                    board.run_ms(1);
                    judge.check();
                }
                break;
            }
            case 6:
                if (what < 64)
                    board.thermistor = static_cast<std::uint16_t>(input.byte() * 4);
                else
                    deliver(board, judge, run_steps(input, steps));
                break;
            default:
                if (what < 32) {
                    board.host_gone();
                    Judge::require(board.lit().empty(), "lit after its host went");
                } else if (what < 48) {
                    Identity identity = HostBoard::some_identity();
                    identity.lamps = input.byte();
                    if (what < 40) identity = lampctl::sealed(identity);
                    if (identity.lamps >= 1 && identity.lamps <= most_lamps) {
                        board.identify(identity);
                        judge.identified(identity);
                    }
                } else {
                    board.strobe();
                }
        }
        judge.check();
    }
    board.thermistor = 100;
    board.run_ms(5);
    Judge::require(board.lit().empty(), "lit while too hot");
}

}  // namespace darkbox::test
