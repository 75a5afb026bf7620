#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "acquisition/camera/camera.h"
#include "acquisition/device/clock.h"
#include "rig/lamps/lamp_array.h"

namespace darkbox::test {

/// Called with the name of every call to the clock, the camera and the lamps, before it does anything.
using Hook = std::function<void(const std::string& call)>;

/// Virtual time; every look at it costs a microsecond, so that whatever polls it gets on.
class FakeClock final : public Clock {
public:
    TimePoint now() const override;
    void sleep_until(TimePoint moment) override;
    Hook hook;

private:
    mutable TimePoint now_{std::chrono::seconds(100)};
};

/// Lamps that remember when which of them was lit.
class FakeLamps final : public LampArray {
public:
    FakeLamps(FakeClock& clock, std::size_t count) : clock_(clock), count_(count) {}

    std::size_t size() const override { return count_; }
    void light(LampId lamp, double level) override;
    void dark() override;
    LampHealth health() override { return {}; }

    bool is_dark() const { return switches_.empty() || !switches_.back().lamp; }
    /// For each lamp, the share of the interval in which it shone.
    std::vector<double> shares(Interval interval) const;
    Nanoseconds longest_on() const;

    Hook hook;
    std::set<std::uint32_t> dead;                              ///< lit in vain
    std::optional<std::pair<std::uint32_t, TimePoint>> stuck;  ///< shines for ever from then on

private:
    struct Switch {
        TimePoint when;
        std::optional<LampId> lamp;
    };
    void set(std::optional<LampId> lamp);

    FakeClock& clock_;
    std::size_t count_;
    std::vector<Switch> switches_;
};

/// A free-running camera with a queue that keeps its oldest frames, looking at the lamps. Its frames tell which lamps
/// really shone: lamp k lights everything a little and column band k a lot; the last band belongs to no lamp.
class FakeCamera final : public Camera {
public:
    FakeCamera(FakeClock& clock, FakeLamps& lamps) : clock_(clock), lamps_(lamps) {}

    CameraInfo configure(const CameraConfig& config) override;
    void start() override;
    Frame next_frame(TimePoint deadline) override;
    void stop() override;

    Hook hook;
    /// May change a frame on its way out; the number counts delivered frames from 0.
    std::function<void(Frame& frame, int number)> tamper;
    /// How much earlier than it says a frame was exposed.
    std::function<Nanoseconds(std::uint64_t sequence)> lie = [](std::uint64_t) { return Nanoseconds{0}; };
    std::set<std::uint64_t> lost;                             ///< sequence numbers that never arrive
    Nanoseconds real_period = std::chrono::milliseconds(25);  ///< whatever it says; before it is started
    bool hanging = false;  ///< delivers nothing; stop() ends it unless it hangs for ever
    bool hangs_for_ever = false;
    std::string id = "0001";
    double black_level = 64;
    double gain_in_effect = 1;
    double contrast = 800;  ///< how much more a lamp lights its band than the rest, in samples
    int starts = 0;
    int delivered = 0;

private:
    enum class State { closed, ready, streaming };
    Frame expose(std::uint64_t sequence);
    void fill_queue();
    TimePoint end_of(std::uint64_t sequence) const;

    FakeClock& clock_;
    FakeLamps& lamps_;
    State state_ = State::closed;
    CameraInfo info_;
    TimePoint started_;
    std::uint64_t next_ = 0;
    std::deque<Frame> queue_;
    std::uint64_t noise_ = 1;
};

/// How much each lamp lit the frame: 1 for the lamp of a good frame, 0 for the others. Needs the default contrast.
std::vector<double> lamps_in(const Frame& frame, std::size_t lamps);

}  // namespace darkbox::test
