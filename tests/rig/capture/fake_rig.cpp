#include "tests/rig/capture/fake_rig.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>

#include "acquisition/device/device_error.h"

namespace darkbox::test {
namespace {

constexpr int width = 60;
constexpr int height = 40;
constexpr double black = 64;
constexpr double everywhere = 400;
constexpr double default_contrast = 800;
constexpr Nanoseconds period = std::chrono::milliseconds(25);
constexpr std::size_t queue_depth = 2;

void call(const Hook& hook, const std::string& name) {
    if (hook) hook(name);
}

/// splitmix64, scaled to [0, 1).
double uniform(std::uint64_t& state) {
    std::uint64_t z = (state += 0x9e3779b97f4a7c15u);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return static_cast<double>((z ^ (z >> 31)) >> 11) * 0x1p-53;
}

/// Near enough to a normal deviate: twelve uniform ones.
double deviate(std::uint64_t& state) {
    double sum = -6;
    for (int i = 0; i < 12; ++i) sum += uniform(state);
    return sum;
}

int band_of(int column, std::size_t lamps) { return column * static_cast<int>(lamps + 1) / width; }

}  // namespace

TimePoint FakeClock::now() const {
    call(hook, "now");
    now_ += std::chrono::microseconds(1);
    return now_;
}

void FakeClock::sleep_until(TimePoint moment) {
    call(hook, "sleep_until");
    now_ = std::max(now_, moment);
}

void FakeLamps::light(LampId lamp, double) {
    call(hook, "light");
    set(lamp);
}

void FakeLamps::dark() {
    call(hook, "dark");
    set(std::nullopt);
}

void FakeLamps::set(std::optional<LampId> lamp) { switches_.push_back({clock_.now(), lamp}); }

std::vector<double> FakeLamps::shares(Interval interval) const {
    std::vector<double> shares(count_, 0.0);
    const auto add = [&](std::uint32_t lamp, TimePoint from, TimePoint to) {
        const Nanoseconds overlap = std::min(to, interval.end) - std::max(from, interval.begin);
        if (overlap.count() > 0) shares.at(lamp) += to_seconds(overlap) / to_seconds(interval.end - interval.begin);
    };
    for (std::size_t i = 0; i < switches_.size(); ++i) {
        const auto lamp = switches_[i].lamp;
        if (!lamp || dead.count(lamp->value) != 0 || (stuck && stuck->first == lamp->value)) continue;
        add(lamp->value, switches_[i].when, i + 1 < switches_.size() ? switches_[i + 1].when : TimePoint::max());
    }
    if (stuck) add(stuck->first, stuck->second, TimePoint::max());
    return shares;
}

Nanoseconds FakeLamps::longest_on() const {
    Nanoseconds longest{0};
    for (std::size_t i = 0; i + 1 < switches_.size(); ++i)
        if (switches_[i].lamp) longest = std::max(longest, switches_[i + 1].when - switches_[i].when);
    return longest;
}

CameraInfo FakeCamera::configure(const CameraConfig& config) {
    call(hook, "configure");
    if (state_ == State::streaming) throw std::logic_error("configure() of a streaming camera");
    state_ = State::ready;
    info_.model = "fake";
    info_.id = id;
    info_.width = width;
    info_.height = height;
    info_.format = PixelFormat::grey16;
    info_.bit_depth = 12;
    info_.black_level = black_level;
    info_.frame_period = Seconds(period);
    info_.queue_depth = queue_depth;
    info_.readout = Seconds(0);
    info_.controls = {config.exposure, config.gain * gain_in_effect};
    return info_;
}

void FakeCamera::start() {
    call(hook, "start");
    if (state_ != State::ready) throw std::logic_error("start() of a camera that is not ready");
    state_ = State::streaming;
    ++starts;
    started_ = clock_.now();
    next_ = 0;
    queue_.clear();
}

void FakeCamera::stop() {
    call(hook, "stop");
    if (state_ == State::streaming) state_ = State::ready;
    hanging = hangs_for_ever;
}

TimePoint FakeCamera::end_of(std::uint64_t sequence) const {
    return started_ + real_period * static_cast<std::int64_t>(sequence + 1);
}

void FakeCamera::fill_queue() {
    for (; end_of(next_) <= clock_.now(); ++next_)
        if (queue_.size() < queue_depth && lost.count(next_) == 0) queue_.push_back(expose(next_));
}

Frame FakeCamera::next_frame(TimePoint deadline) {
    call(hook, "next_frame");
    if (state_ != State::streaming) throw std::logic_error("next_frame() of a camera that does not stream");
    if (!hanging) fill_queue();
    while (!hanging && queue_.empty() && end_of(next_) <= deadline) {
        clock_.sleep_until(end_of(next_));
        fill_queue();
    }
    if (hanging || queue_.empty()) {
        clock_.sleep_until(deadline);
        throw DeadlineError("the fake camera delivered nothing", "none");
    }
    Frame frame = std::move(queue_.front());
    queue_.pop_front();
    if (tamper) tamper(frame, delivered);
    ++delivered;
    return frame;
}

Frame FakeCamera::expose(std::uint64_t sequence) {
    Frame frame;
    frame.width = width;
    frame.height = height;
    frame.format = info_.format;
    frame.bit_depth = info_.bit_depth;
    frame.black_level = black;
    frame.sequence = sequence;
    frame.controls = info_.controls;
    frame.exposure = {end_of(sequence) - to_nanoseconds(info_.controls.exposure), end_of(sequence)};
    frame.timestamp = frame.exposure.begin;

    const Nanoseconds late = lie(sequence);
    const std::vector<double> shares = lamps_.shares({frame.exposure.begin - late, frame.exposure.end - late});
    std::vector<std::uint16_t> samples;
    for (int row = 0; row < height; ++row) {
        for (int column = 0; column < width; ++column) {
            double signal = 0;
            for (std::size_t lamp = 0; lamp < shares.size(); ++lamp)
                signal += shares[lamp] *
                          (everywhere + (band_of(column, shares.size()) == static_cast<int>(lamp) ? contrast : 0));
            const double sample = black + signal + std::sqrt(4 + 0.05 * signal) * deviate(noise_);
            samples.push_back(static_cast<std::uint16_t>(std::clamp(std::round(sample), 0.0, 4095.0)));
        }
    }
    frame.pixels.resize(samples.size() * 2);
    std::memcpy(frame.pixels.data(), samples.data(), frame.pixels.size());
    return frame;
}

std::vector<double> lamps_in(const Frame& frame, std::size_t lamps) {
    std::vector<double> sums(lamps + 1, 0.0);
    std::vector<double> counts(lamps + 1, 0.0);
    for (int i = 0; i < frame.width * frame.height; ++i) {
        std::uint16_t sample = 0;
        std::memcpy(&sample, frame.pixels.data() + i * 2, 2);
        const auto band = static_cast<std::size_t>(band_of(i % frame.width, lamps));
        sums[band] += sample;
        counts[band] += 1;
    }
    std::vector<double> result;
    const double common = sums[lamps] / counts[lamps];
    for (std::size_t lamp = 0; lamp < lamps; ++lamp)
        result.push_back((sums[lamp] / counts[lamp] - common) / default_contrast);
    return result;
}

}  // namespace darkbox::test
