#pragma once

#include "acquisition/device/unique_fd.h"
#include "acquisition/frame/units.h"
#include "rig/lamps/gpio_lines.h"

namespace darkbox {

/// The guardian's whole life (guardian.h) in a process that was forked from its daemon. When the channel closes it
/// darkens the lamps and ends. SIGTERM and the terminal's signals do not end it.
[[noreturn]] void guard_lamps(UniqueFd channel, const RequestLines& request_lines, Nanoseconds silence) noexcept;

/// The guardian as a program of its own, on a Unix socket (SOCK_SEQPACKET) that listens. One daemon is served at a
/// time, of this process' user or root; whoever else connects is hung up on, and told why where it is another daemon of
/// theirs. When the daemon goes, the lamps are dark, and the lines are held so for the next. Returns after SIGTERM, but
/// while a daemon is connected, which may light a lamp at any moment, not before it has gone.
void serve_guardian(UniqueFd listening, const RequestLines& request_lines, Nanoseconds silence);

}  // namespace darkbox
