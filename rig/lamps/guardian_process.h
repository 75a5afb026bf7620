#pragma once

#include <array>
#include <cstdint>
#include <type_traits>

#include "acquisition/device/unique_fd.h"
#include "acquisition/frame/units.h"
#include "rig/lamps/gpio_lines.h"

namespace darkbox {

/// What the guardian is told, one datagram each. Bit i of a step is line i of the request.
struct GuardianCommand {
    enum class Kind : std::uint32_t {
        beat,    ///< the daemon lives; the one command without a reply
        open,    ///< request the lines, anew where they are held
        drive,   ///< set the steps one after another; the last stays
        report,  ///< fails where the lines are not open, or the guardian darkened them by itself
    };
    static constexpr std::size_t most_steps = 3;

    Kind kind = Kind::beat;
    std::uint32_t steps = 0;
    std::array<std::uint64_t, most_steps> step{};
    std::int64_t at_most_ns = 0;  ///< how long the last step may stay; 0: it is dark and stays for ever
};

struct GuardianReply {
    std::uint32_t failed = 0;
    std::array<char, 800> what{};  ///< of the error, ended by zero
    std::array<char, 800> hint{};
};
static_assert(std::is_trivially_copyable_v<GuardianCommand> && std::is_trivially_copyable_v<GuardianReply>);

/// The guardian's whole life, in the forked process: the one that holds the lines. It darkens them, and goes on holding
/// them dark, when a lamp was lit for too long or nothing was heard for `silence`; then it lights nothing until it was
/// told to darken. When the channel closes it darkens them and ends. SIGTERM and the terminal's signals do not end it.
[[noreturn]] void guard_lamps(UniqueFd channel, const GpioRequest& request, const RequestLines& request_lines,
                              Nanoseconds silence) noexcept;

}  // namespace darkbox
