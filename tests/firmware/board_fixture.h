#pragma once

#include <cstring>
#include <initializer_list>
#include <vector>

#include "firmware/board/host/host_board.h"

namespace darkbox::test {

namespace proto = darkbox::lamp_protocol;

inline proto::LightCommand light(std::initializer_list<unsigned> lamps, std::uint8_t level = 255) {
    proto::LightCommand command{};
    for (const unsigned lamp : lamps) command.lamps[lamp / 8] |= static_cast<std::uint8_t>(1U << lamp % 8);
    command.level = level;
    return command;
}

inline proto::ConfigureCommand configure(std::uint16_t heartbeat_ms, std::uint8_t most_lit) {
    return {heartbeat_ms, most_lit, 0};
}

inline proto::LimitCommand limit(std::uint8_t first, std::uint8_t count, std::uint16_t max_on_ms,
                                 std::uint8_t cooling = 64) {
    return {first, count, max_on_ms, cooling, {}};
}

inline proto::Step step(std::uint8_t lamp, std::uint32_t lead_us, std::uint32_t exposure_us, std::uint8_t mode = 0,
                        std::uint8_t level = 255) {
    proto::Step made{};
    made.lamp_and_mode = lamp | mode;
    made.level = level;
    proto::write_24(made.lead_us, lead_us);
    proto::write_24(made.exposure_us, exposure_us);
    return made;
}

inline proto::RunProgramCommand run_command(const std::vector<proto::Step>& steps, std::uint16_t rounds = 1) {
    proto::RunProgramCommand run{};
    run.count = static_cast<std::uint8_t>(steps.size());
    run.rounds = rounds;
    run.crc = proto::crc16(steps.data(), steps.size() * sizeof(proto::Step));
    return run;
}

/// The payloads that upload these steps.
inline std::vector<std::vector<std::uint8_t>> upload(const std::vector<proto::Step>& steps) {
    std::vector<std::vector<std::uint8_t>> payloads;
    for (std::size_t first = 0; first < steps.size(); first += proto::steps_per_packet) {
        const std::size_t count = std::min<std::size_t>(proto::steps_per_packet, steps.size() - first);
        std::vector<std::uint8_t> payload(4 + count * sizeof(proto::Step));
        payload[0] = static_cast<std::uint8_t>(first);
        payload[1] = static_cast<std::uint8_t>(count);
        std::memcpy(payload.data() + 4, &steps[first], count * sizeof(proto::Step));
        payloads.push_back(payload);
    }
    return payloads;
}

inline proto::Outcome outcome(const proto::Event& reply) { return static_cast<proto::Outcome>(reply.code); }

inline void write_program(lampctl::HostBoard& board, const std::vector<proto::Step>& steps) {
    for (const auto& payload : upload(steps))
        board.command(proto::Command::write_steps, payload.data(), payload.size());
}

inline std::vector<proto::Event> of_kind(const std::vector<proto::Event>& events, proto::EventKind kind) {
    std::vector<proto::Event> found;
    for (const proto::Event& event : events)
        if (event.kind == kind) found.push_back(event);
    return found;
}

}  // namespace darkbox::test
