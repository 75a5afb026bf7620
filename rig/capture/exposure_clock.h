#pragma once

#include <cstdint>
#include <deque>
#include <optional>

#include "acquisition/camera/camera.h"

namespace darkbox {

/// Where a frame's exposure really lies beside its timestamp, as measured with the lamps (see measure_latency.h): from
/// the stamp to the first row's begin and to the last row's end. Both may be negative.
struct MeasuredTiming {
    Nanoseconds begin_from_stamp{0};
    Nanoseconds end_from_stamp{0};
    Nanoseconds readout{0};  ///< from the first row's end to the last row's
    Nanoseconds margin{0};   ///< how far off these may be
};

/// The rhythm of a free-running camera, learned from its timestamps: a straight line through the latest frames' numbers
/// and stamps. It predicts exposures that have not happened yet, smooths the jitter of single stamps, and finds stamps
/// that do not belong. Thread-compatible.
class ExposureClock {
public:
    ExposureClock(const CameraInfo& camera, std::optional<MeasuredTiming> measured);

    /// Learns from a frame. Returns whether its stamp keeps the rhythm; before there is one, every stamp does. A stamp
    /// that does not is not learned from, but several in a row begin a new rhythm.
    bool follow(const Frame& frame);
    /// Forgets the rhythm: the camera was started anew.
    void restart();

    /// There is a rhythm to predict by. A camera whose stamps are half a period or more off a straight line has none:
    /// it delivers when it can, or slower than it says.
    bool locked() const { return places_.size() >= wanted_places && 2 * worst_off_ < nominal_period_; }
    Nanoseconds period() const { return Nanoseconds(static_cast<Nanoseconds::rep>(period_)); }
    /// Of a camera that has no rhythm although enough frames came: how far its stamps may be off, at most a period;
    /// else nothing.
    Nanoseconds doubt() const;
    /// How far an exposure may lie from where it is predicted.
    Nanoseconds margin() const;

    /// First row's begin to last row's end by the frame's own stamp, as measured where it was, else as the driver says.
    Interval exposure_of(const Frame& frame) const;
    /// The stamp of a frame by the rhythm; must be locked.
    TimePoint stamp(std::uint64_t sequence) const;
    /// The exposure by the rhythm; must be locked.
    Interval predicted(std::uint64_t sequence) const;
    /// The first frame whose predicted exposure begins at `moment` or later; must be locked.
    std::uint64_t first_from(TimePoint moment) const;

private:
    static constexpr std::size_t wanted_places = 8;
    struct Place {
        std::uint64_t sequence = 0;
        TimePoint stamp;
    };
    double off(const Place& place) const;  ///< ns from where the line says
    Nanoseconds tolerance() const;
    void fit();

    double nominal_period_;  ///< ns
    std::optional<MeasuredTiming> measured_;
    std::deque<Place> places_;
    int strangers_ = 0;     ///< stamps in a row that did not keep the rhythm
    Place origin_;          ///< of the line
    double offset_ = 0;     ///< ns, of the line at the origin
    double period_;         ///< ns, the line's slope
    double worst_off_ = 0;  ///< ns, of the places that the line goes through
    Nanoseconds begin_from_stamp_{0};
    Nanoseconds end_from_stamp_ = Nanoseconds::min();
};

}  // namespace darkbox
