#include "tests/rig/capture/study/study_rig.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <utility>

#include "acquisition/device/device_error.h"

namespace darkbox::test {
namespace {

constexpr double black = 64;
constexpr std::size_t burns_kept = 16;
constexpr std::size_t truths_kept = 256;
constexpr double late_burst_chance = 0.005;
constexpr double spike_chance = 0.05;

Nanoseconds ns(double seconds) { return to_nanoseconds(Seconds(seconds)); }

}  // namespace

std::uint64_t StudyRandom::next() {
    std::uint64_t z = (state_ += 0x9e3779b97f4a7c15u);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
}

/// The sum of three uniform numbers is near enough, and its tails end.
double StudyRandom::normal() { return 2 * (uniform() + uniform() + uniform() - 1.5); }

std::string_view name(Lie lie) {
    switch (lie) {
        case Lie::none:
            return "none";
        case Lie::offset:
            return "offset";
        case Lie::reception:
            return "reception";
        case Lie::spikes:
            return "spikes";
        case Lie::late_buffers:
            break;
    }
    return "late buffers";
}

void StudyClock::sleep_until(TimePoint moment) { now_ = std::max(now_, moment); }

void StudyLamps::set(std::optional<LampId> lamp, TimePoint when) {
    if (lamp == lit_) return;
    const auto a_while = [&] { return ns(random_.uniform(0, case_.settle)); };
    if (lit_) {
        burns_.back().until = when + a_while();
        last_lit_ = when;
    }
    lit_ = lamp;
    if (!lamp) return;
    burns_.push_back({lamp->value, when + a_while()});
    if (burns_.size() > burns_kept) burns_.pop_front();
    first_lit_ = std::min(first_lit_, when);
}

void StudyLamps::stall() {
    if (std::ranges::find(case_.stalled, switches_++) != case_.stalled.end()) clock_.pass(ns(case_.stall));
}

void StudyLamps::light(LampId lamp, double) {
    stall();
    if (catch_up) catch_up();
    next_step_ = program_.size();
    clock_.pass(ns(random_.uniform(2e-6, 20e-6)));
    set(lamp, clock_.now());
    clock_.pass(ns(random_.uniform(2e-6, 20e-6)));
}

void StudyLamps::dark() {
    if (lit_) stall();
    if (catch_up) catch_up();
    next_step_ = program_.size();
    clock_.pass(ns(random_.uniform(2e-6, 20e-6)));
    set(std::nullopt, clock_.now());
}

void StudyLamps::arm(const std::vector<StrobeStep>& program, Nanoseconds /*exposed*/) {
    dark();
    events_.clear();
    program_ = program;
    next_step_ = 0;
}

void StudyLamps::strobe(TimePoint moment) {
    if (next_step_ == program_.size()) return;
    set(program_[next_step_].lamp, moment);
    events_.push_back({next_step_++, {moment, moment + ns(2e-6)}});
}

std::vector<StrobeEvent> StudyLamps::take_events() {
    if (catch_up) catch_up();
    return std::exchange(events_, {});
}

std::vector<StudyLamps::Share> StudyLamps::shares(const Interval& interval) const {
    std::vector<Share> shares;
    const double whole = to_seconds(interval.end - interval.begin);
    for (const Burn& burn : burns_) {
        const Nanoseconds overlap = std::min(burn.until, interval.end) - std::max(burn.from, interval.begin);
        if (overlap.count() > 0) shares.push_back({burn.lamp, to_seconds(overlap) / whole});
    }
    return shares;
}

StudyCamera::StudyCamera(const StudyCase& c, StudyClock& clock, StudyLamps& lamps)
    : case_(c), clock_(clock), lamps_(lamps), random_(c.seed), true_period_(c.period) {
    // A body lit from another side by every lamp, and a small highlight.
    StudyRandom random(c.seed + 77);
    for (std::size_t lamp = 0; lamp < c.lamps; ++lamp) {
        const double phase = random.uniform(0, 6.28), tilt = random.uniform(0, 6.28);
        const int highlight = random.whole(0, static_cast<int>(pixels) - 1);
        for (int i = 0; i < static_cast<int>(pixels); ++i) {
            const double body = 500 + 400 * std::sin(phase + 0.2 * (i % width)) * std::cos(tilt + 0.25 * (i / width));
            patterns_.push_back(std::max(0.0, body) + (i == highlight ? 2500 : 0));
        }
    }
    true_period_ = c.period * (1 + random.uniform(-2e-3, 2e-3));
    lamps_.catch_up = [this] { strobe_until_now(); };
}

CameraInfo StudyCamera::configure(const CameraConfig& config) {
    info_ = {};
    info_.model = "study";
    info_.id = "study";
    info_.driver = "study";
    info_.width = width;
    info_.height = height;
    info_.bit_depth = 12;
    info_.black_level = black;
    info_.frame_period = Seconds(case_.period);
    info_.queue_depth = case_.queue;
    info_.readout = Seconds(case_.readout);
    info_.controls = {config.exposure, config.gain};
    return info_;
}

void StudyCamera::start() {
    streaming_ = true;
    start_ = clock_.now() + ns(random_.uniform(0, case_.period));
    next_ = next_strobe_ = 0;
    queue_.clear();
}

void StudyCamera::stop() { streaming_ = false; }

Interval StudyCamera::row(std::uint64_t sequence, int row) const {
    const TimePoint begin = start_ + ns(true_period_ * static_cast<double>(sequence) +
                                        case_.readout * static_cast<double>(row) / (height - 1));
    return {begin, begin + ns(case_.exposure)};
}

TimePoint StudyCamera::delivery(std::uint64_t sequence) const {
    return row(sequence, height - 1).end + ns(0.001 * case_.period) + ns(true_period_ * case_.latency);
}

void StudyCamera::strobe_until_now() {
    if (!streaming_) return;
    for (; row(next_strobe_, height - 1).end <= clock_.now(); ++next_strobe_)
        lamps_.strobe(row(next_strobe_, height - 1).end);
}

void StudyCamera::fill_queue() {
    strobe_until_now();
    for (; delivery(next_) <= clock_.now(); ++next_) {
        if (case_.lie == Lie::late_buffers && late_left_ == 0 && next_ > 12 && random_.uniform() < late_burst_chance)
            late_left_ = random_.whole(1, 8);
        const std::uint64_t late = late_left_ > 0 ? static_cast<std::uint64_t>(case_.lie_frames) : 0;
        if (late_left_ > 0) --late_left_;
        if (queue_.size() < static_cast<std::size_t>(case_.queue))
            queue_.push_back({next_, next_ - std::min(next_, late)});
    }
}

Frame StudyCamera::next_frame(TimePoint deadline) {
    fill_queue();
    while (queue_.empty()) {
        if (delivery(next_) > deadline) {
            clock_.sleep_until(deadline);
            throw DeadlineError("the study's camera has no frame yet", "wait longer");
        }
        clock_.sleep_until(delivery(next_));
        fill_queue();
    }
    const Finished finished = queue_.front();
    queue_.pop_front();
    clock_.pass(ns(random_.uniform(5e-6, 50e-6)));
    return deliver(finished);
}

Frame StudyCamera::deliver(const Finished& finished) {
    Frame frame;
    frame.width = width;
    frame.height = height;
    frame.format = info_.format;
    frame.bit_depth = info_.bit_depth;
    frame.black_level = black;
    frame.sequence = finished.sequence;
    frame.controls = info_.controls;

    double off = random_.uniform(0, case_.jitter);
    if (case_.lie == Lie::offset) off += case_.lie_by;
    if (case_.lie == Lie::reception) off += case_.exposure;
    if (case_.lie == Lie::spikes && random_.uniform() < spike_chance) off += case_.lie_by;
    frame.timestamp = row(finished.sequence, 0).begin + ns(off);
    frame.exposure = {frame.timestamp, frame.timestamp + ns(case_.exposure + case_.readout)};

    StudyTruth truth{finished.sequence, std::nullopt, 1.0, 0.0};
    std::map<std::uint32_t, double> light;
    std::vector<std::vector<StudyLamps::Share>> rows;
    for (int y = 0; y < height; ++y) {
        rows.push_back(lamps_.shares(row(finished.picture, y)));
        for (const auto& share : rows.back()) light[share.lamp] += share.share;
    }
    const auto most =
        std::max_element(light.begin(), light.end(), [](auto& a, auto& b) { return a.second < b.second; });
    if (most != light.end()) truth.lamp = most->first;

    StudyRandom noise(case_.seed * 1'000'003 + finished.picture);  // of the exposure, however often it is delivered
    std::vector<std::uint16_t> samples(pixels);
    for (int y = 0; y < height; ++y) {
        double own = 0, all = 0;
        for (const auto& share : rows[static_cast<std::size_t>(y)]) {
            all += share.share;
            if (truth.lamp == share.lamp) own += share.share;
        }
        truth.own = std::min(truth.own, own);
        if (all > 0) truth.foreign = std::max(truth.foreign, (all - own) / all);
        for (int x = 0; x < width; ++x) {
            double signal = 0;
            for (const auto& share : rows[static_cast<std::size_t>(y)])
                signal += share.share * pattern(share.lamp, y * width + x);
            const double sample = black + signal + std::sqrt(2 + 0.05 * signal) * noise.normal();
            samples[static_cast<std::size_t>(y * width + x)] =
                static_cast<std::uint16_t>(std::clamp(std::round(sample), 0.0, 4095.0));
        }
    }
    frame.pixels.resize(2 * pixels);
    std::memcpy(frame.pixels.data(), samples.data(), frame.pixels.size());
    truths_.push_back(truth);
    if (truths_.size() > truths_kept) truths_.pop_front();
    return frame;
}

std::optional<StudyTruth> StudyCamera::truth_of(std::uint64_t sequence) const {
    const auto found = std::find_if(truths_.rbegin(), truths_.rend(), [&](auto& t) { return t.sequence == sequence; });
    return found == truths_.rend() ? std::nullopt : std::optional(*found);
}

}  // namespace darkbox::test
