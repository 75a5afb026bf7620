#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <string_view>
#include <vector>

#include "acquisition/camera/camera.h"
#include "acquisition/device/clock.h"
#include "rig/lamps/lamp_array.h"
#include "rig/lamps/strobed_lamps.h"

namespace darkbox::test {

/// splitmix64.
class StudyRandom {
public:
    explicit StudyRandom(std::uint64_t seed) : state_(seed) {}
    std::uint64_t next();
    double uniform(double least = 0, double most = 1) {
        return least + (most - least) * static_cast<double>(next() >> 11) * 0x1p-53;
    }
    int whole(int least, int most) {
        return least + static_cast<int>(next() % static_cast<std::uint64_t>(most - least + 1));
    }
    double normal();

private:
    std::uint64_t state_;
};

/// What a camera's timestamps get wrong besides jitter.
enum class Lie {
    none,
    offset,       ///< all are off by the same part of a period, or by more than one
    reception,    ///< called the start of exposure, they are the start of reception, as uvcvideo's
    spikes,       ///< single ones are off
    late_buffers  ///< for some frames in a row the pictures are whole frames older than their stamps and numbers
};
std::string_view name(Lie lie);

/// One camera and its lamps. Times in seconds.
struct StudyCase {
    double period = 1.0 / 30;
    double exposure = 0.02;
    double readout = 0;  ///< of a rolling shutter; 0: global
    int latency = 0;     ///< frames from the end of a frame to its delivery
    int queue = 2;       ///< frames that wait
    double jitter = 0;   ///< stamps are late by up to this
    Lie lie = Lie::none;
    double lie_by = 0;       ///< offset: seconds by which the picture is older than its stamp says; spikes: off by this
    int lie_frames = 0;      ///< late_buffers: how old
    double settle = 0.0005;  ///< what rig.toml says; the lamps come up and fade within it
    std::size_t lamps = 64;
    std::vector<int> stalled = {};  ///< switches, counted from 0, in whose calls the host does other work at first
    double stall = 0;               ///< for so long
    std::uint64_t seed = 1;
};

class StudyClock final : public Clock {
public:
    TimePoint now() const override { return now_; }
    void sleep_until(TimePoint moment) override;
    void pass(Nanoseconds time) { now_ += time; }

private:
    TimePoint now_{std::chrono::seconds(100)};
};

/// Lamps that come up and fade a random while after the call, which takes a while itself.
class StudyLamps final : public LampArray, public StrobedLamps {
public:
    StudyLamps(const StudyCase& c, StudyClock& clock) : case_(c), clock_(clock), random_(c.seed * 3 + 1) {}

    std::size_t size() const override { return case_.lamps; }
    void light(LampId lamp, double level) override;
    void dark() override;
    LampHealth health() override { return {}; }
    StrobedLamps* strobed() override { return this; }
    void arm(const std::vector<StrobeStep>& program, Nanoseconds exposed) override;
    std::vector<StrobeEvent> take_events() override;

    void strobe(TimePoint moment);
    std::function<void()> catch_up;

    struct Share {
        std::uint32_t lamp = 0;
        double share = 0;
    };
    /// What really shone during the interval, as shares of it.
    std::vector<Share> shares(const Interval& interval) const;
    bool lit() const { return lit_.has_value(); }
    TimePoint first_lit() const { return first_lit_; }
    TimePoint last_lit() const { return last_lit_; }

private:
    struct Burn {
        std::uint32_t lamp = 0;
        TimePoint from;
        TimePoint until = TimePoint::max();
    };
    void set(std::optional<LampId> lamp, TimePoint when);
    void stall();

    const StudyCase& case_;
    StudyClock& clock_;
    StudyRandom random_;
    std::deque<Burn> burns_;
    std::optional<LampId> lit_;
    TimePoint first_lit_ = TimePoint::max();
    TimePoint last_lit_;
    std::vector<StrobeStep> program_;
    std::size_t next_step_ = 0;
    std::vector<StrobeEvent> events_;
    int switches_ = 0;
};

/// What is true of a delivered frame.
struct StudyTruth {
    std::uint64_t sequence = 0;
    std::optional<std::uint32_t> lamp;  ///< that gave the most light
    double own = 0;                     ///< the least share of full light that it gave a row
    double foreign = 0;                 ///< the most light of other lamps in a row, as a share of that row's
};

/// A free-running camera in virtual time with tiny frames of 12 bits: every lamp gives a picture of its own.
class StudyCamera final : public Camera {
public:
    StudyCamera(const StudyCase& c, StudyClock& clock, StudyLamps& lamps);

    CameraInfo configure(const CameraConfig& config) override;
    void start() override;
    Frame next_frame(TimePoint deadline) override;
    void stop() override;

    std::optional<StudyTruth> truth_of(std::uint64_t sequence) const;

private:
    struct Finished {
        std::uint64_t sequence = 0;
        std::uint64_t picture = 0;  ///< the exposure whose picture it carries
    };
    Interval row(std::uint64_t sequence, int row) const;
    TimePoint delivery(std::uint64_t sequence) const;
    void strobe_until_now();
    void fill_queue();
    Frame deliver(const Finished& finished);
    double pattern(std::uint32_t lamp, int pixel) const {
        return patterns_[lamp * pixels + static_cast<std::size_t>(pixel)];
    }

    static constexpr int width = 32, height = 24;
    static constexpr std::size_t pixels = width * height;

    const StudyCase& case_;
    StudyClock& clock_;
    StudyLamps& lamps_;
    StudyRandom random_;
    std::vector<double> patterns_;
    CameraInfo info_;
    TimePoint start_;
    double true_period_;
    bool streaming_ = false;
    std::uint64_t next_ = 0;
    std::uint64_t next_strobe_ = 0;
    int late_left_ = 0;
    std::deque<Finished> queue_;
    std::deque<StudyTruth> truths_;
};

}  // namespace darkbox::test
