#include "rig/capture/settled_shots.h"

#include <fmt/format.h>

#include <algorithm>

#include "acquisition/device/device_error.h"

namespace darkbox {
namespace {

/// Flicker, the settling of controls and imperfect noise models together move a share of light by less.
constexpr double least_tolerance = 0.03;
/// Beyond this no moment of a switch would tell anything.
constexpr double most_tolerance = 0.6;

double share_of(Nanoseconds part, Seconds whole) { return to_seconds(part) / whole.count(); }

}  // namespace

TakenShot SettledShots::take(const Shot& shot) {
    switch_to(shot);
    const TimePoint steady = std::max(on_, lamps_.timeline().steady_from()) + margin_;
    const TimePoint deadline = deadline_of(shot, steady);
    TakenShot taken{first_after(steady, shot, deadline), on_, on_, ""};
    const double after = to_seconds(taken.frame.exposure.begin - taken.on);
    taken.words = fmt::format("exposed {:.1f} ms after the switch, within the steady time; {}", after * 1000.0,
                              accept(shot, taken.frame, deadline));
    taken.off = clock_.now();
    lamps_.dark();
    if (shot.lamp) last_lamp_ = shot.lamp;
    return taken;
}

void SettledShots::switch_to(const Shot& shot) {
    if (shot.lamp) {
        wait_for_a_telling_moment(*shot.lamp);
        lamps_.light(*shot.lamp);
    } else {
        lamps_.dark();
    }
    on_ = clock_.now();
}

/// A switch early in an exposure spoils that frame as one a little later does, but only the latter leaves enough of the
/// old light in the first rows to tell by. The very first lamp waits for the middle of one: what its frame tells holds
/// for all.
void SettledShots::wait_for_a_telling_moment(LampId lamp) {
    const bool first_of_all = !check_.knows_noise();
    if (!source_.info().readout || margin_ > Nanoseconds(0)) return;
    if (first_of_all) source_.find_rhythm(clock_.now() + 12 * source_.rhythm().period());
    const ExposureClock& rhythm = source_.rhythm();
    const WitnessTolerance tolerance = witness_tolerance(lamp);
    if (!rhythm.locked() || tolerance.late + tolerance.early > most_tolerance) return;
    const TimePoint now = clock_.now();
    if (first_of_all) {
        const Interval next = rhythm.predicted(rhythm.first_from(now));
        return clock_.sleep_until(next.begin + (next.end - next.begin) / 2);
    }
    const Nanoseconds steady_after = to_nanoseconds(tolerance.late * source_.info().controls.exposure);
    const std::uint64_t wanted = rhythm.first_from(now + steady_after);
    if (wanted == 0) return;
    const TimePoint telling = rhythm.predicted(wanted - 1).begin + to_nanoseconds(source_.info().controls.exposure) / 3;
    if (now < telling && rhythm.first_from(telling + steady_after) == wanted) clock_.sleep_until(telling);
}

Frame SettledShots::first_after(TimePoint earliest, const Shot& shot, TimePoint deadline) {
    try {
        return source_.first_after(earliest, deadline);
    } catch (const DeadlineError&) {
        if (shot.lamp && clock_.now() >= on_ + to_nanoseconds(lamp(shot).max_on))
            throw DeadlineError(
                fmt::format("no frame came within the lamp's max_on_s of {} s", lamp(shot).max_on.count()),
                "check the camera, or raise max_on_s of the lamp if it bears that");
        throw;
    }
}

std::string SettledShots::accept(const Shot& shot, const Frame& frame, TimePoint deadline) {
    if (!shot.lamp) return check_.accept_dark(frame);
    refuse_repeats();
    const auto spoiled = source_.take_passed_over();
    const Testimony testimony = spoiled ? hear(shot, *spoiled, frame) : Testimony::none;
    if (testimony == Testimony::agrees)
        return check_.accept_lit(lamp(shot).name, frame) + "; the frame before shows the switch when it was";
    const bool first_of_all = !check_.knows_noise();
    const Frame confirming = first_after(frame.exposure.begin, shot, deadline);
    refuse_repeats();
    std::string words = check_.accept_lit(lamp(shot).name, frame, &confirming);
    const bool lies = testimony == Testimony::contradicts ||
                      (first_of_all && spoiled && hear(shot, *spoiled, frame) == Testimony::contradicts);
    if (lies) throw_lies(*spoiled);
    return words;
}

/// A picture that comes twice, be it while older frames are passed over, puts those after it in the wrong place.
void SettledShots::refuse_repeats() {
    if (source_.repeats() == known_repeats_) return;
    known_repeats_ = source_.repeats();
    throw InputError("the camera delivered one picture twice, bit for bit, as two frames",
                     "the camera or its driver is at fault; plug it in again or update it");
}

/// From now on no timestamp is believed: every wait is as long as pictures can be held back.
void SettledShots::throw_lies(const Frame& spoiled) {
    distrust_timestamps();
    throw InputError(fmt::format("frame {}, during which the lamps were switched, was not exposed when its timestamp "
                                 "says",
                                 spoiled.sequence),
                     "darkbox rig measure-latency measures how far the timestamps are off");
}

/// How far an honest frame may be from what its timestamp lets expect.
WitnessTolerance SettledShots::witness_tolerance(LampId lamp) const {
    Seconds settle = rig_.lamps.at(lamp.value).settle;
    if (last_lamp_) settle = std::max(settle, rig_.lamps.at(last_lamp_->value).settle);
    const double stamps = least_tolerance + share_of(source_.rhythm().margin(), source_.info().controls.exposure);
    return {stamps + share_of(to_nanoseconds(settle), source_.info().controls.exposure), stamps};
}

SettledShots::Testimony SettledShots::hear(const Shot& shot, const Frame& spoiled, const Frame& frame) const {
    const ExposureClock& rhythm = source_.rhythm();
    const WitnessTolerance tolerance = witness_tolerance(*shot.lamp);
    if (margin_ > Nanoseconds(0) || !rhythm.locked() || !source_.info().readout ||
        tolerance.late + tolerance.early > most_tolerance)
        return Testimony::none;
    const Seconds exposure = source_.info().controls.exposure;
    const TimePoint steady = lamps_.timeline().steady_from();
    if (rhythm.predicted(frame.sequence).begin < steady + to_nanoseconds(tolerance.early * exposure))
        return Testimony::none;
    const Interval span = rhythm.predicted(spoiled.sequence);
    const std::optional<std::string> before =
        last_lamp_ ? std::optional(rig_.lamps.at(last_lamp_->value).name) : std::nullopt;
    const auto expected = [&](double height) {
        const TimePoint begin = span.begin + to_nanoseconds(height * *source_.info().readout);
        const Interval row{begin, begin + to_nanoseconds(exposure)};
        return LightShares{last_lamp_ ? lamps_.timeline().share(*last_lamp_, row) : 0.0,
                           lamps_.timeline().share(*shot.lamp, row)};
    };
    const auto report = check_.hear(before, spoiled, &frame, expected, tolerance);
    if (!report || !report->informative) return Testimony::none;
    return report->agrees ? Testimony::agrees : Testimony::contradicts;
}

Nanoseconds SettledShots::held_back() const {
    constexpr int spare_frames = 4;
    return frame_time() * (source_.info().queue_depth + source_.info().latency_frames + spare_frames);
}

void SettledShots::distrust_timestamps() { margin_ = held_back(); }

Nanoseconds SettledShots::frame_time() const {
    return to_nanoseconds(std::max(source_.info().frame_period, source_.info().controls.exposure));
}

/// A camera that works needs the queued frames and two more; one that hangs is given frame_deadline besides. A lamp is
/// never left on for longer than it bears.
TimePoint SettledShots::deadline_of(const Shot& shot, TimePoint steady) const {
    const TimePoint patience =
        steady + frame_time() * (source_.info().queue_depth + 4) + to_nanoseconds(rig_.capture.frame_deadline);
    return shot.lamp ? std::min(patience, on_ + to_nanoseconds(lamp(shot).max_on)) : patience;
}

}  // namespace darkbox
