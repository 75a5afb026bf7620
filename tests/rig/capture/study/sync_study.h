#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "rig/capture/frame_source.h"
#include "rig/description/rig_description.h"
#include "tests/rig/capture/study/study_rig.h"

namespace darkbox::test {

/// What came of some sessions of the study.
struct StudyTally {
    std::size_t sessions = 0;
    std::size_t failed = 0;    ///< ended with an error instead of a session
    std::size_t lights = 0;    ///< frames accepted
    std::size_t wrong = 0;     ///< of these, lit mainly by another lamp, or by none
    std::size_t foreign = 0;   ///< of these, with more than 0.1 % of another lamp's light in some row
    double worst_foreign = 0;  ///< share of a row's light
    std::size_t dim = 0;       ///< of these, with a row that lacks more than 1 % of its own lamp's light
    double worst_own = 1;      ///< the least share of its own lamp's light in a row
    std::size_t rejected = 0;  ///< exposures thrown away and taken again
    std::size_t unfit = 0;     ///< sessions in which the mode said that it does not fit, and settled mode took over
    std::vector<double>
        speed;  ///< for each session in its own mode: lights a frame period, over what the mode promises
    std::map<std::string, std::size_t> errors;

    void add(const StudyTally& other);
    /// The share of sessions in their own mode that were as fast as asked for: 0.9 / (2 + latency) lights a frame
    /// period in settled mode, 0.95 in the others.
    double at_the_aim(SyncMode mode) const;
};

/// A camera drawn at random: 1 to 120 frames a second, exposure 10 to 95 % of the period, latency 0 to 4 frames, queue
/// 1 to 8, jitter, rolling or global shutter.
StudyCase draw_case(std::uint64_t seed, Lie lie);

RigDescription rig_of(const StudyCase& c, SyncMode mode);

/// One session through run_capture(): dark, 64 lamps, dark.
StudyTally study_session(const StudyCase& c, SyncMode mode, const TimingLookup& timings = {});

struct StudyRow {
    SyncMode mode = SyncMode::settled;
    Lie lie = Lie::none;
    StudyTally tally;
};

/// At least this many lights over all modes and lies, on `threads` threads; the same for any number of them.
std::vector<StudyRow> run_study(std::size_t lights, int threads, std::uint64_t first_seed = 1);

/// For docs/decisions.
std::string table(const std::vector<StudyRow>& rows);

}  // namespace darkbox::test
