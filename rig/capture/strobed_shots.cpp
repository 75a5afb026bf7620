#include "rig/capture/strobed_shots.h"

#include <fmt/format.h>

#include <algorithm>

namespace darkbox {
namespace {

/// Of a program: its first lamp may be exposed twice, and darkness ends it.
constexpr std::size_t most_shots = StrobedLamps::longest_program - 2;
constexpr int frames_beyond_program = 16;

}  // namespace

Unproven StrobedShots::take(std::span<const Shot> shots, const ShotSink& proven) {
    unproven_ = {};
    const auto give_up = [&](const std::string& reason) {
        unproven_.stay_settled = true;
        leave(shots, reason);
        return unproven_;
    };
    if (!lamps_.array().strobed()) return give_up("these lamps have no strobe line");
    if (!source_.find_rhythm(clock_.now() + 32 * source_.rhythm().period() +
                             to_nanoseconds(rig_.capture.frame_deadline)))
        return give_up("the camera's timestamps keep no rhythm");
    GapBudget budget = gap_budget(source_.rhythm(), rig_, shots);
    budget.margin = source_.rhythm().margin();
    if (!budget.fits()) return give_up("the gap between exposures is too short: " + budget.words());
    for (std::size_t first = 0; first < shots.size(); first += most_shots) {
        const auto part = shots.subspan(first, std::min(most_shots, shots.size() - first));
        try {
            take_program(part, budget, proven);
        } catch (const DeviceError& error) {
            // Some lamp of the program may have shone: it must fade as any other.
            lamps_.timeline().switched({clock_.now(), clock_.now()}, part.front().lamp);
            lamps_.dark();
            leave(shots.subspan(first), error.what());
            return unproven_;
        }
    }
    return unproven_;
}

void StrobedShots::leave(std::span<const Shot> shots, const std::string& reason) {
    unproven_.shots.insert(unproven_.shots.end(), shots.begin(), shots.end());
    if (std::find(unproven_.reasons.begin(), unproven_.reasons.end(), reason) == unproven_.reasons.end())
        unproven_.reasons.push_back(reason);
}

StrobedShots::Stepped StrobedShots::step_through(const std::vector<StrobeStep>& program, const GapBudget& budget) {
    Stepped stepped;
    StrobedLamps& strobed = *lamps_.array().strobed();
    const ExposureClock& rhythm = source_.rhythm();
    const auto frames = static_cast<int>(program.size()) + source_.info().queue_depth + frames_beyond_program;
    const TimePoint deadline = clock_.now() + frames * rhythm.period() + to_nanoseconds(rig_.capture.frame_deadline);
    // In the middle of what is left of the gap: the exposure is over, and there is time to settle before the next.
    strobed.arm(program, budget.exposed + (budget.period - budget.exposed - budget.settle) / 2);
    bool done = false;
    while (!done) {
        try {
            auto frame = source_.next_until(deadline);
            if (!frame)
                throw DeadlineError(
                    fmt::format("the strobe made {} of {} steps in time", stepped.events.size(), program.size()),
                    "check the camera's strobe line and its polarity");
            if (const auto repeated = source_.repeated())
                stepped.doubt =
                    fmt::format("frame {} repeats the picture of frame {} bit for bit", frame->sequence, *repeated);
            const std::vector<StrobeEvent> events = strobed.take_events();
            stepped.events.insert(stepped.events.end(), events.begin(), events.end());
            done = stepped.events.size() == program.size() &&
                   frame->exposure.begin + rhythm.period() / 20 >= stepped.events.back().moment.begin;
            if (source_.in_rhythm()) stepped.frames.push_back(std::move(*frame));
        } catch (const DamagedFrame& error) {
            unproven_.reasons.emplace_back(error.what());
        }
    }
    lamps_.array().dark();
    return stepped;
}

void StrobedShots::take_program(std::span<const Shot> shots, const GapBudget& budget, const ShotSink& proven) {
    std::vector<StrobeStep> program;
    for (const Shot& shot : shots) {
        // The first of all is exposed twice: two exposures tell what the noise comes to.
        if (program.empty() && !check_.knows_noise()) program.push_back({shot.lamp});
        program.push_back({shot.lamp});
    }
    program.push_back({});
    const std::size_t extra = program.size() - shots.size() - 1;
    Stepped stepped = step_through(program, budget);
    for (const StrobeEvent& event : stepped.events) lamps_.note(event, program.at(event.step).lamp);

    if (!stepped.doubt.empty()) return leave(shots, stepped.doubt);
    // The line itself keeps steps out of exposures: stamps need only tell which exposure it was.
    const Nanoseconds margin = std::max(source_.rhythm().margin(), source_.rhythm().period() / 20);
    const PictureCheck before = check_;
    std::vector<TakenShot> taken(shots.size());
    std::vector<char> found(shots.size(), 0);
    try {
        for (std::size_t i = 0; i < shots.size(); ++i) {
            const TimePoint on = stepped.events.at(i == 0 ? 0 : i + extra).moment.end;
            const TimePoint off = stepped.events.at(i + extra + 1).moment.begin;
            std::vector<Frame*> frames;
            for (Frame& frame : stepped.frames) {
                const Interval exposure = source_.rhythm().predicted(frame.sequence);
                if (exposure.begin + margin >= on && exposure.end - margin <= off) frames.push_back(&frame);
            }
            if (frames.empty()) continue;
            const bool learns = !check_.knows_noise();
            if (learns && frames.size() < 2) continue;
            const std::string words =
                check_.accept_lit(rig_.lamps.at(shots[i].lamp->value).name, *frames[0], learns ? frames[1] : nullptr);
            const double after = to_milliseconds(frames[0]->exposure.begin - on);
            taken[i] = {std::move(*frames[0]), on, off,
                        fmt::format("exposed {:.1f} ms after the strobe's step; {}", after, words)};
            found[i] = 1;
        }
    } catch (const InputError& error) {
        check_ = before;
        return leave(shots, error.what());
    }
    for (std::size_t i = 0; i < shots.size(); ++i) {
        if (found[i])
            proven(shots[i], std::move(taken[i]));
        else
            leave(shots.subspan(i, 1),
                  fmt::format("lamp '{}': its frame was lost", rig_.lamps.at(shots[i].lamp->value).name));
    }
}

}  // namespace darkbox
