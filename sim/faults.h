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
    sequence_wrap,  ///< from this frame on the driver counts from 0 again, as a counter that overflows
    unplug,         ///< the camera is gone from this frame on, and comes back at the `count`th start after that
    door_open,      ///< the box is open while this frame and the `count` - 1 after it are the latest delivered
    leaking_lamp,   ///< while the first lamp burns the other glows by `amount` of its full light
    dim_lamp,       ///< the lamp gives `amount` of its light
    pwm,            ///< the lamps are dimmed to half by pulses, `amount` a second; their mean light stays
    nonlinear,      ///< signal x of full scale 1 becomes x + 4 * amount * x (1 - x): off by `amount` at half scale
    defocus,        ///< the picture is blurred by a Gaussian of `amount` pixels
    camera_knock,   ///< the picture lies `amount` pixels further right
    warming,        ///< the black level is too high by `amount` of full scale at first, by half every 30 s
    hot_lamps,      ///< the lamps' heat sink has `amount` degrees Celsius
    object_knock,   ///< what is not the mirror ball lies `amount` pixels further right
};

/// One fault. Camera faults: `at` is the frame's sequence and `count` frames are hit (hang: `count` waits). Lamp
/// faults: `at` is the number of the light() or dark() call, counted from 0, from which on it holds. Those with an
/// amount last from `at` on; `count` is not used for them.
struct Fault {
    FaultKind kind = FaultKind::drop;
    std::uint64_t at = 0;
    std::uint64_t count = 1;
    LampId lamp;   ///< dead, stuck, swapped, leaking, dim
    LampId other;  ///< swapped; what glows along
    double amount = 0.0;
};

/// All the faults of one run. Plain data.
struct FaultPlan {
    std::vector<Fault> faults;

    /// Whether a camera fault of this kind hits frame `sequence`.
    bool hits(FaultKind kind, std::uint64_t sequence) const;
    /// The amount of a lasting fault of this kind that began by frame `sequence`; the latest one counts.
    std::optional<double> amount(FaultKind kind, std::uint64_t sequence) const;
};

/// Whether any of them moves or blurs what the camera sees, for which all its colours must be known.
bool changes_what_is_seen(const FaultPlan& plan);

/// "drop@7", "hang@3x2" (count), "dead-lamp@0:4", "swapped-lamps@0:2,5", "leaking-lamp@0:3,5=0.02" (amount); several
/// joined by spaces. Throws InputError with the known names. docs/faults.md says what each does to a capture.
FaultPlan parse_faults(const std::string& text);

}  // namespace darkbox::sim
