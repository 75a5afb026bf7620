#include "tests/rig/capture/study/sync_study.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <numeric>
#include <thread>

#include "acquisition/frame/error.h"
#include "rig/capture/capture_run.h"

namespace darkbox::test {
namespace {

constexpr std::size_t lamps = 64;
constexpr double foreign_limit = 0.001;
constexpr double dim_limit = 0.01;

/// Judges every accepted frame by the camera's truth.
class StudySink final : public FrameSink {
public:
    StudySink(const StudyCamera& camera, StudyTally& tally) : camera_(camera), tally_(tally) {}

    const std::vector<FrameRecord>& kept() const override { return kept_; }
    Frame read(const FrameRecord&) const override { throw std::logic_error("nothing is kept"); }
    void withdraw(const std::string& file, const std::string&) override { throw std::logic_error("withdrew " + file); }
    void note_event(const std::string& what) override {
        if (what.find("is too short") != std::string::npos) unfit = true;
        if (what.find(" mode: ") != std::string::npos) left_mode = true;
    }
    bool has_room() const override { return true; }

    void add(Frame frame, FrameRecord record) override {
        if (record.kind != FrameKind::lit) return;
        ++tally_.lights;
        const StudyTruth truth = camera_.truth_of(frame.sequence).value();
        if (!record.lamp || truth.lamp != record.lamp->value) {
            ++tally_.wrong;
            return;
        }
        tally_.worst_foreign = std::max(tally_.worst_foreign, truth.foreign);
        tally_.worst_own = std::min(tally_.worst_own, truth.own);
        if (truth.foreign > foreign_limit) ++tally_.foreign;
        if (truth.own < 1 - dim_limit) ++tally_.dim;
    }

    bool unfit = false;
    bool left_mode = false;

private:
    const StudyCamera& camera_;
    StudyTally& tally_;
    std::vector<FrameRecord> kept_;
};

/// What the mode promises: lights a frame period.
double promise(const StudyCase& c, SyncMode mode) { return mode == SyncMode::settled ? 1.0 / (2 + c.latency) : 1.0; }

double percent(std::size_t part, std::size_t whole) {
    return whole == 0 ? 0.0 : 100.0 * static_cast<double>(part) / static_cast<double>(whole);
}

}  // namespace

RigDescription rig_of(const StudyCase& c, SyncMode mode) {
    RigDescription rig;
    rig.name = "study";
    rig.camera.exposure = Seconds(c.exposure);
    rig.capture.mode = mode;
    for (std::size_t i = 0; i < c.lamps; ++i) {
        LampDescription lamp;
        lamp.name = fmt::format("lamp-{:02}", i + 1);
        lamp.max_on = Seconds(600);
        lamp.settle = Seconds(c.settle);
        rig.lamps.push_back(lamp);
    }
    return rig;
}

double StudyTally::at_the_aim(SyncMode mode) const {
    const double aim = mode == SyncMode::settled ? 0.90 : 0.95;
    const auto reached = std::count_if(speed.begin(), speed.end(), [&](double s) { return s >= aim; });
    return speed.empty() ? 0.0 : static_cast<double>(reached) / static_cast<double>(speed.size());
}

void StudyTally::add(const StudyTally& o) {
    sessions += o.sessions;
    failed += o.failed;
    lights += o.lights;
    wrong += o.wrong;
    foreign += o.foreign;
    worst_foreign = std::max(worst_foreign, o.worst_foreign);
    dim += o.dim;
    worst_own = std::min(worst_own, o.worst_own);
    rejected += o.rejected;
    unfit += o.unfit;
    speed.insert(speed.end(), o.speed.begin(), o.speed.end());
    for (const auto& [what, count] : o.errors) errors[what] += count;
}

StudyCase draw_case(std::uint64_t seed, Lie lie) {
    StudyRandom random(seed * 7919 + 13);
    StudyCase c;
    c.seed = seed;
    c.period = 1.0 / std::exp(random.uniform(0, std::log(120.0)));
    c.exposure = c.period * random.uniform(0.10, 0.95);
    c.readout = random.whole(0, 1) == 0 ? 0.0 : c.period * random.uniform(0.05, 0.9);
    c.latency = random.whole(0, 4);
    c.queue = random.whole(1, 8);
    c.jitter = c.period * random.uniform(0, 0.02);
    c.settle = c.period * random.uniform(0, 0.03);
    c.lie = lie;
    c.lie_frames = random.whole(1, 3);
    c.lie_by = lie == Lie::spikes ? c.period * random.uniform(0.05, 0.6) : c.period * random.uniform(0.02, 2.5);
    return c;
}

StudyTally study_session(const StudyCase& c, SyncMode mode, const TimingLookup& timings) {
    StudyTally tally;
    tally.sessions = 1;
    StudyClock clock;
    StudyLamps lamp_array(c, clock);
    StudyCamera camera(c, clock, lamp_array);
    StudySink sink(camera, tally);
    const RigDescription rig = rig_of(c, mode);
    const CapturePlan plan = plan_capture(rig);
    try {
        const CaptureSummary summary = run_capture(plan, rig, {lamp_array, camera, clock}, sink, {}, timings);
        tally.rejected = static_cast<std::size_t>(summary.repeated);
        const double periods = to_seconds(lamp_array.last_lit() - lamp_array.first_lit()) / c.period;
        if (!sink.unfit) tally.speed.push_back(static_cast<double>(c.lamps) / periods / promise(c, mode));
        if (sink.unfit) tally.unfit = 1;
    } catch (const Error& error) {
        tally.failed = 1;
        const std::string what = error.what();
        const auto last = what.rfind("the last time ");
        ++tally.errors[last == std::string::npos ? what : what.substr(last + 14, 40)];
    }
    return tally;
}

std::vector<StudyRow> run_study(std::size_t lights, int threads, std::uint64_t first_seed) {
    constexpr std::array modes{SyncMode::settled, SyncMode::predictive, SyncMode::strobed};
    // Honest cameras are the rule; half of the lights are theirs.
    constexpr std::array lies{Lie::none,   Lie::none,      Lie::none,   Lie::none,
                              Lie::offset, Lie::reception, Lie::spikes, Lie::late_buffers};
    const std::size_t sessions = (lights + lamps - 1) / lamps;
    std::vector<StudyRow> rows;
    for (const SyncMode mode : modes)
        for (const Lie lie : {Lie::none, Lie::offset, Lie::reception, Lie::spikes, Lie::late_buffers})
            rows.push_back({mode, lie, {}});
    std::vector<StudyTally> tallies(sessions);
    std::atomic<std::size_t> next{0};
    const auto lie_of = [&](std::size_t i) { return lies[(i / modes.size()) % lies.size()]; };
    const auto work = [&] {
        for (std::size_t i = next++; i < sessions; i = next++)
            tallies[i] = study_session(draw_case(first_seed + i, lie_of(i)), modes[i % modes.size()]);
    };
    {
        std::vector<std::jthread> workers;
        for (int t = 0; t < threads; ++t) workers.emplace_back(work);
    }
    for (std::size_t i = 0; i < sessions; ++i)
        for (StudyRow& row : rows)
            if (row.mode == modes[i % modes.size()] && row.lie == lie_of(i)) row.tally.add(tallies[i]);
    return rows;
}

std::string table(const std::vector<StudyRow>& rows) {
    std::string text =
        "| mode | timestamps | sessions | failed | lights | wrong | foreign > 0.1 % | worst foreign | rejected | "
        "unfit | at the aim | speed: 5 % | median |\n"
        "| --- | --- | --: | --: | --: | --: | --: | --: | --: | --: | --: | --: | --: |\n";
    for (const StudyRow& row : rows) {
        const StudyTally& t = row.tally;
        std::vector<double> speed = t.speed;
        std::sort(speed.begin(), speed.end());
        const auto at = [&](double part) {
            return speed.empty()
                       ? std::string("-")
                       : fmt::format("{:.3f}",
                                     speed[static_cast<std::size_t>(part * static_cast<double>(speed.size() - 1))]);
        };
        text += fmt::format("| {} | {} | {} | {} | {} | {} | {} | {:.4f} % | {:.2f} % | {} | {} | {} | {} |\n",
                            name(row.mode), name(row.lie), t.sessions, t.failed, t.lights, t.wrong, t.foreign,
                            100 * t.worst_foreign, percent(t.rejected, t.lights), t.unfit,
                            fmt::format("{:.2f} %", 100 * t.at_the_aim(row.mode)), at(0.05), at(0.5));
    }
    return text;
}

}  // namespace darkbox::test
