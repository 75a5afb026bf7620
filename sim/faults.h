#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "acquisition/frame/ids.h"

namespace darkbox::sim {

/// What can go wrong on request.
enum class FaultKind {
    drop,           ///< the frame is lost: a gap in the sequence
    error_flag,     ///< the driver flags the frame; its lower half is garbage
    repeat,         ///< the picture of the frame before, under a new sequence and timestamp
    stale_queue,    ///< a frame exposed queue_depth + 1 periods earlier, with its own old sequence and timestamp
    black_frame,    ///< the picture shows no light at all
    hang,           ///< next_frame() gives nothing until its deadline
    dead_lamp,      ///< the lamp stays dark
    stuck_lamp,     ///< the lamp burns on, whatever is commanded
    swapped_lamps,  ///< two lamps answer to each other's number
};

/// One fault. Camera faults: `at` is the frame's sequence and `count` frames are hit (hang: `count` waits). Lamp
/// faults: `at` is the number of the light() or dark() call, counted from 0, from which on it holds; `count` is not
/// used.
struct Fault {
    FaultKind kind = FaultKind::drop;
    std::uint64_t at = 0;
    std::uint64_t count = 1;
    LampId lamp;   ///< dead, stuck, swapped
    LampId other;  ///< swapped
};

/// All the faults of one run. Plain data.
struct FaultPlan {
    std::vector<Fault> faults;

    /// Whether a camera fault of this kind hits frame `sequence`.
    bool hits(FaultKind kind, std::uint64_t sequence) const;
};

/// "drop@7", "hang@3x2" (count), "dead-lamp@0:4", "swapped-lamps@0:2,5"; several joined by spaces. Throws InputError
/// with the known names.
FaultPlan parse_faults(const std::string& text);

}  // namespace darkbox::sim
