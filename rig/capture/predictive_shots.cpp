#include "rig/capture/predictive_shots.h"

#include <fmt/format.h>

#include <algorithm>

#include "acquisition/device/device_error.h"

namespace darkbox {
namespace {

/// How finely a witness can be heard, in shares of an exposure.
constexpr double witness_blur = 0.02;
/// Frames held until their block is proven.
constexpr std::size_t held_bytes = std::size_t{256} << 20;
constexpr std::size_t longest_block = 64;
constexpr std::size_t shortest_block = 4;
/// Before a switch this much time is left alone: fetching a frame could take longer.
constexpr Nanoseconds longest_guard = std::chrono::milliseconds(3);
/// Beyond its queue, so many may be late before the camera is said to hang.
constexpr std::uint64_t spare_frames = 16;
/// What a call to the lamps is expected to take at most; one that takes longer costs a frame.
constexpr Nanoseconds switching_time = std::chrono::microseconds(50);
/// Switches in mid-exposure that are tried for one witness.
constexpr int most_probes = 3;
/// How long a lamp burns on the way, in frame periods: for its own frame, and for each witness that is tried again.
constexpr int shot_periods = 3;
constexpr int retry_periods = 2;
/// A call to the lamps that takes longer leaves open when they were switched, in tolerances.
constexpr double longest_call = 4;

}  // namespace

Unproven PredictiveShots::take(std::span<const Shot> shots, const ShotSink& proven) {
    shots_ = shots;
    proven_ = &proven;
    pending_.clear();
    witnesses_.clear();
    repeats_.clear();
    block_ = 0;
    next_look_ = 0;
    block_doubt_.clear();
    check_before_ = check_;
    unproven_ = {};
    const auto give_up = [&](const std::string& reason) {
        unproven_.stay_settled = true;
        leave(0, shots_.size(), reason);
        return unproven_;
    };
    if (!source_.info().readout)
        return give_up("the camera's read-out is not known: darkbox rig measure-latency measures it");
    if (!source_.find_rhythm(clock_.now() + 32 * source_.rhythm().period() +
                             to_nanoseconds(rig_.capture.frame_deadline)))
        return give_up("the camera's timestamps keep no rhythm");
    if (!budget().fits()) return give_up("the gap between exposures is too short: " + budget().words());
    if (!probe_share())
        return give_up("the exposure is too short beside the lamps' settling and the jitter: " + budget().words());
    if (!lamps_bear(shot_periods)) return give_up("a lamp's max_on_s is shorter than three frames");
    try {
        run();
    } catch (const DeviceError& error) {
        lamps_.dark();
        settle_blocks(false);
        check_ = std::move(*check_before_);
        const std::size_t settled = block_ == 0 ? 0 : *witnesses_[block_].before + 1;
        leave(settled, shots_.size(), error.what());
        return unproven_;
    }
    settle_blocks(true);
    return unproven_;
}

bool PredictiveShots::lamps_bear(int periods) const {
    return std::all_of(shots_.begin(), shots_.end(), [&](const Shot& shot) {
        return periods * source_.rhythm().period() <= to_nanoseconds(rig_.lamps.at(shot.lamp->value).max_on);
    });
}

GapBudget PredictiveShots::budget() const {
    const ExposureClock& rhythm = source_.rhythm();
    GapBudget budget = gap_budget(rhythm, rig_, shots_);
    budget.switching = switching_time;
    budget.margin = 2 * rhythm.margin() + to_nanoseconds(witness_blur * source_.info().controls.exposure);
    return budget;
}

std::size_t PredictiveShots::shots_in_a_block() const {
    const CameraInfo& info = source_.info();
    const std::size_t bytes = static_cast<std::size_t>(info.width) * static_cast<std::size_t>(info.height) *
                              static_cast<std::size_t>(channels(info.format) * bytes_per_sample(info.format));
    return std::clamp(held_bytes / std::max<std::size_t>(bytes, 1), shortest_block, longest_block);
}

void PredictiveShots::run() {
    const std::size_t block = shots_in_a_block();
    seen_ = source_.rhythm().first_from(clock_.now());
    probe(std::nullopt, 0);
    for (std::size_t shot = 1; shot < shots_.size(); ++shot) {
        if (shot % block == 0)
            probe(shot - 1, shot);
        else
            light(shot, gap_after(last_frame_));
        expect_frames();
        settle_blocks(false);
    }
    probe(shots_.size() - 1, std::nullopt);
    await(witnesses_.back().sequence);
}

/// The lamps are not to be driven on while the camera hangs.
void PredictiveShots::expect_frames() const {
    const auto patience = static_cast<std::uint64_t>(source_.info().queue_depth) + spare_frames;
    if (source_.rhythm().first_from(clock_.now()) > seen_ + patience)
        throw DeadlineError("the camera stopped delivering frames", "check the camera's cable and the load on its bus");
}

/// The middle of what the gap leaves when the lamp has settled.
TimePoint PredictiveShots::gap_after(std::uint64_t sequence) const {
    const Interval before = source_.rhythm().predicted(sequence);
    const Interval after = source_.rhythm().predicted(sequence + 1);
    return before.end + std::max(Nanoseconds(0), after.begin - before.end - budget().settle - switching_time) / 2;
}

Interval PredictiveShots::light(std::size_t shot, TimePoint moment) {
    pump_until(moment);
    const ExposureClock& rhythm = source_.rhythm();
    if (!pending_.empty()) pending_.back().off = clock_.now();
    const Interval call = lamps_.light(*shots_[shot].lamp);
    Pending pending;
    pending.on = clock_.now();
    pending.first = rhythm.first_from(lamps_.timeline().steady_from() + rhythm.margin());
    last_frame_ = pending.first + (check_.knows_noise() || shot > 0 ? 0 : 1);
    pending_.push_back(std::move(pending));
    return call;
}

WitnessTolerance PredictiveShots::tolerance() const {
    const double exposure = source_.info().controls.exposure.count();
    const double stamps = witness_blur + to_seconds(source_.rhythm().margin()) / exposure;
    return {stamps + to_seconds(budget().settle) / exposure, stamps};
}

/// The share of an exposure that a probe leaves to the lamp of after, so that the spoiled frame tells as much as it can
/// of stamps that are off either way; none where it could not tell.
std::optional<double> PredictiveShots::probe_share() const {
    constexpr double telling = 1.4;
    const WitnessTolerance most = tolerance();
    if (telling * (most.late + most.early) >= 1) return std::nullopt;
    return (1 + telling * (most.late - most.early)) / 2;
}

/// Switches in the middle of an exposure. A switch that comes so late, or takes so long, that its frame could not tell
/// anything is taken back and tried again where the lamps bear it: a block of frames hangs on it.
void PredictiveShots::probe(std::optional<std::size_t> before, std::optional<std::size_t> after) {
    const ExposureClock& rhythm = source_.rhythm();
    Witness& witness = witnesses_.emplace_back();
    witness.before = before;
    witness.after = after;
    const std::uint64_t first = before ? last_frame_ + 1 : 0;
    const int attempts = lamps_bear(shot_periods + (most_probes - 1) * retry_periods) ? most_probes : 1;
    for (int attempt = 1;; ++attempt) {
        const TimePoint from =
            std::max(clock_.now() + longest_guard, lamps_.timeline().steady_from() + rhythm.margin());
        witness.sequence = std::max(rhythm.first_from(from), first);
        if (switch_within(witness) || attempt == attempts) return;
        take_back(before, after);
        witness.frame.reset();
    }
}

/// Whether it went as planned, or well enough for the witness to be heard.
bool PredictiveShots::switch_within(const Witness& witness) {
    const Seconds exposure = source_.info().controls.exposure;
    const TimePoint moment = source_.rhythm().predicted(witness.sequence).begin +
                             to_nanoseconds(*source_.info().readout / 2 + (1 - probe_share().value_or(0.5)) * exposure);
    Interval call;
    if (witness.after) {
        call = light(*witness.after, moment);
    } else {
        pump_until(moment);
        pending_.back().off = clock_.now();
        call = lamps_.dark();
    }
    const WitnessTolerance most = tolerance();
    const Seconds bound = most.early * exposure;
    if (call.end - call.begin > longest_call * bound) return false;
    return call.end <= moment + bound ||
           can_tell(expected_in(witness), source_.info().height, witness.after.has_value(), most);
}

void PredictiveShots::take_back(std::optional<std::size_t> before, std::optional<std::size_t> after) {
    if (after) pending_.pop_back();
    if (before)
        lamps_.light(*shots_[*before].lamp);
    else
        lamps_.dark();
}

void PredictiveShots::pump_until(TimePoint moment) {
    const TimePoint stop = moment - std::min(longest_guard, source_.rhythm().period() / 8);
    while (clock_.now() < stop) {
        try {
            auto frame = source_.next_until(stop);
            if (!frame) break;
            file(std::move(*frame));
        } catch (const DamagedFrame& error) {
            unproven_.reasons.emplace_back(error.what());
        }
    }
    clock_.sleep_until(moment);
}

void PredictiveShots::await(std::uint64_t sequence) {
    const CameraInfo& info = source_.info();
    const TimePoint deadline =
        clock_.now() + source_.rhythm().period() * (info.queue_depth + 8) + to_nanoseconds(rig_.capture.frame_deadline);
    while (seen_ < sequence) {
        try {
            auto frame = source_.next_until(deadline);
            if (!frame)
                throw DeadlineError("no frame came after the last lamp",
                                    "check the camera, or raise frame_deadline_s of [capture]");
            file(std::move(*frame));
        } catch (const DamagedFrame& error) {
            unproven_.reasons.emplace_back(error.what());
        }
    }
}

void PredictiveShots::file(Frame frame) {
    seen_ = std::max(seen_, frame.sequence);
    if (const auto repeated = source_.repeated())
        repeats_.push_back({frame.sequence, fmt::format("frame {} repeats the picture of frame {} bit for bit",
                                                        frame.sequence, *repeated)});
    for (Witness& witness : witnesses_)
        if (witness.sequence == frame.sequence && source_.in_rhythm()) {
            witness.frame = std::move(frame);
            return;
        }
    if (!source_.in_rhythm()) return;
    const Interval exposure = source_.rhythm().predicted(frame.sequence);
    const auto light = lamps_.timeline().sole_light(exposure, source_.rhythm().margin());
    if (!light || !light->lamp) return;
    const auto next = std::upper_bound(pending_.begin(), pending_.end(), frame.sequence,
                                       [](std::uint64_t s, const Pending& p) { return s < p.first; });
    if (next == pending_.begin()) return;
    Pending& pending = *std::prev(next);
    const auto shot = static_cast<std::size_t>(std::prev(next) - pending_.begin());
    if (light->lamp != shots_[shot].lamp) return;
    if (!pending.frame)
        pending.frame = std::move(frame);
    else if (!pending.confirming && shot == 0)
        pending.confirming = std::move(frame);
}

/// Blocks whose closing witness is there are proven or left. `all`: no frame comes any more.
void PredictiveShots::settle_blocks(bool all) {
    while (block_ + 1 < witnesses_.size()) {
        Witness& opening = witnesses_[block_];
        Witness& closing = witnesses_[block_ + 1];
        // A probe that failed on its way left its witness without the lamp that it was to light.
        const bool after_is_there =
            closing.after && *closing.after < pending_.size() && pending_[*closing.after].frame.has_value();
        const bool complete = closing.after ? after_is_there : closing.frame.has_value();
        const std::size_t first = *opening.after, last = *closing.before + 1;
        look_at_pictures(last, complete || all);
        if (!complete && !all) return;
        const std::string doubt = verify(first, last, opening, closing);
        if (!doubt.empty()) {
            check_ = std::move(*check_before_);
            leave(first, last, doubt);
        }
        for (std::size_t i = first; i < last; ++i) pending_[i].confirming.reset();
        ++block_;
        begin_block();
    }
    look_at_pictures(pending_.size(), false);
}

void PredictiveShots::begin_block() {
    next_look_ = witnesses_[block_].after.value_or(pending_.size());
    block_doubt_.clear();
    check_before_ = check_;
}

/// Looks at the pictures of the present block's shots before `last`, in their order: as far as they are there, or at
/// all of them, where no more of the block's frames come.
void PredictiveShots::look_at_pictures(std::size_t last, bool all) {
    for (; next_look_ < last && block_doubt_.empty(); ++next_look_) {
        Pending& pending = pending_[next_look_];
        const bool over = all || (next_look_ + 1 < pending_.size() && seen_ >= pending_[next_look_ + 1].first);
        const bool enough = pending.frame && (check_.knows_noise() || pending.confirming);
        if (!over && !enough) return;
        if (!pending.frame) continue;
        try {
            if (enough)
                pending.found = check_.accept_lit(name_of(next_look_), *pending.frame,
                                                  pending.confirming ? &*pending.confirming : nullptr);
            else
                block_doubt_ = fmt::format("lamp '{}': no second frame to learn the noise from", name_of(next_look_));
        } catch (const InputError& error) {
            block_doubt_ = error.what();
        }
    }
}

void PredictiveShots::leave(std::size_t first, std::size_t last, const std::string& reason) {
    unproven_.shots.insert(unproven_.shots.end(), shots_.begin() + static_cast<std::ptrdiff_t>(first),
                           shots_.begin() + static_cast<std::ptrdiff_t>(last));
    if (std::find(unproven_.reasons.begin(), unproven_.reasons.end(), reason) == unproven_.reasons.end())
        unproven_.reasons.push_back(reason);
}

/// Why the block's frames cannot be believed; empty when they can, and then they are handed on.
std::string PredictiveShots::verify(std::size_t first, std::size_t last, Witness& opening, Witness& closing) {
    for (const Repeat& repeat : repeats_)
        if (repeat.sequence >= opening.sequence && repeat.sequence <= closing.sequence)
            return *(closing.doubt = repeat.words);
    if (!block_doubt_.empty()) return *(closing.doubt = block_doubt_);
    for (Witness* witness : {&opening, &closing}) {
        if (!witness->doubt) witness->doubt = heard(*witness);
        if (!witness->doubt->empty()) return *witness->doubt;
    }
    for (std::size_t i = first; i < last; ++i) {
        if (pending_[i].frame && !pending_[i].found.empty())
            hand_on(i);
        else
            leave(i, i + 1, fmt::format("lamp '{}': its frame was lost", name_of(i)));
    }
    return "";
}

void PredictiveShots::hand_on(std::size_t shot) {
    Pending& pending = pending_[shot];
    const double after = to_milliseconds(pending.frame->exposure.begin - pending.on);
    (*proven_)(shots_[shot],
               {std::move(*pending.frame), pending.on, pending.off,
                fmt::format("exposed {:.1f} ms after the switch, which fell into the gap; {}", after, pending.found)});
    pending.frame.reset();
}

/// By the switches as they really were.
ExpectedShares PredictiveShots::expected_in(const Witness& witness) const {
    const Seconds exposure = source_.info().controls.exposure;
    const Interval span = source_.rhythm().predicted(witness.sequence);
    return [this, span, exposure, before = witness.before, after = witness.after](double height) {
        const TimePoint begin = span.begin + to_nanoseconds(height * *source_.info().readout);
        const Interval row{begin, begin + to_nanoseconds(exposure)};
        const auto share = [&](std::optional<std::size_t> shot) {
            return shot ? lamps_.timeline().share(*shots_[*shot].lamp, row) : 0.0;
        };
        return LightShares{share(before), share(after)};
    };
}

/// Why the witness does not bear out the timestamps; empty when it does.
std::string PredictiveShots::heard(const Witness& witness) const {
    const std::string who = fmt::format("frame {}, during which the lamps were switched,", witness.sequence);
    if (!witness.frame) return who + " was lost";
    const Frame* after = nullptr;
    if (witness.after) {
        if (!pending_[*witness.after].frame) return who + " has no frame after it to compare with";
        after = &*pending_[*witness.after].frame;
    }
    const std::optional<std::string> before = witness.before ? std::optional(name_of(*witness.before)) : std::nullopt;
    const auto report = check_.hear(before, *witness.frame, after, expected_in(witness), tolerance());
    if (!report || !report->informative) return who + " shows too little of both lights to tell when it was exposed";
    if (report->agrees) return "";
    return fmt::format("{} was exposed {:.2f} ms from where its timestamp says", who,
                       1000.0 * source_.info().controls.exposure.count() * std::max(report->latest, report->earliest));
}

}  // namespace darkbox
