#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <type_traits>

#include "rig/lamps/gpio_lines.h"

namespace darkbox {

// How a daemon talks to its lamps' guardian: one datagram a packet over a Unix socket (SOCK_SEQPACKET), told apart by
// its size, in this machine's byte order. A guardian that runs by itself speaks first, by its greeting. Then the daemon
// opens the lines and commands; each packet of its but the beat is answered by a reply. What is none of these ends the
// talk.

/// Bit i of a step is line i of the request.
struct GuardianCommand {
    enum class Kind : std::uint32_t {
        beat,    ///< the daemon lives; the one packet without a reply
        drive,   ///< set the steps one after another; the last stays
        report,  ///< fails where the lines are not open, or the guardian darkened them by itself
    };
    static constexpr std::size_t most_steps = 3;

    Kind kind = Kind::beat;
    std::uint32_t steps = 0;
    std::array<std::uint64_t, most_steps> step{};
    std::int64_t at_most_ns = 0;  ///< how long the last step may stay; 0: it is dark and stays for ever
};

/// Request these lines, inactive. Those that are held already are darkened, and go on being held.
struct GuardianOpening {
    struct Line {
        std::array<char, 63> name{};  ///< ended by zero, as all texts here are
        std::uint8_t active_low = 0;
    };
    static constexpr std::size_t most_lines = 64;

    std::array<char, 64> chip{};
    std::uint32_t lines = 0;
    std::array<Line, most_lines> line{};
};

struct GuardianReply {
    std::uint32_t failed = 0;
    std::array<char, 800> what{};  ///< of the error
    std::array<char, 800> hint{};
};

struct GuardianGreeting {
    static constexpr std::uint32_t this_version = 1;

    std::uint32_t version = this_version;
    std::int32_t process = 0;  ///< the guardian's own; 0: it refuses, and the reply says why
    GuardianReply reply{};
};

static_assert(std::is_trivially_copyable_v<GuardianCommand> && std::is_trivially_copyable_v<GuardianOpening> &&
              std::is_trivially_copyable_v<GuardianReply> && std::is_trivially_copyable_v<GuardianGreeting>);
static_assert(sizeof(GuardianCommand) != sizeof(GuardianOpening));

/// Throws InputError for more lines, or longer names, than a packet holds.
GuardianOpening guardian_opening(const GpioRequest& request);
/// No value for one that no guardian_opening() made.
std::optional<GpioRequest> request_in(const GuardianOpening& opening);

/// The failed reply that tells this error; text that is too long is cut.
GuardianReply guardian_refusal(const std::string& what, const std::string& hint);

}  // namespace darkbox
