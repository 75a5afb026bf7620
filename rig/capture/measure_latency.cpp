#include "rig/capture/measure_latency.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "acquisition/frame/error.h"
#include "rig/capture/frame_source.h"
#include "rig/capture/switch_witness.h"
#include "rig/capture/timed_lamps.h"

namespace darkbox {
namespace {

/// Shares nearer to none or all are cut off by the ends of the exposure.
constexpr double least_share = 0.08;
/// Standard deviations of the readings by which the result may be off.
constexpr double spreads = 3.0;
constexpr double most_sigma = 0.05;
constexpr std::size_t fewest_readings = 8;
constexpr int frames_to_be_sure = 4;

/// One row of one frame.
struct Reading {
    double height = 0.0;       ///< 0 = first row, 1 = last
    double share = 0.0;        ///< of the lamp's light
    double on_from_stamp = 0;  ///< s, from the frame's stamp to the switch
};

class Measurement {
public:
    Measurement(const RigDescription& rig, const CaptureDevices& devices, const LatencyOptions& options,
                const WorkContext& work)
        : rig_(rig),
          clock_(devices.clock),
          options_(options),
          work_(work),
          source_(devices.camera, devices.clock, {rig.camera.exposure, rig.camera.gain}, work),
          lamps_(devices.lamps, devices.clock, rig) {}

    LatencyReport run() {
        lamps_.dark();
        if (!source_.find_rhythm(clock_.now() + 32 * period() + to_nanoseconds(rig_.capture.frame_deadline)))
            throw InputError("the camera's timestamps keep no rhythm",
                             "switch off what changes the frame rate, dynamic frame rate and automatic exposure, or "
                             "give frame_rate in [camera]");
        learn_pictures();
        for (int flip = 0; flip < options_.flips; ++flip) {
            work_.tell({"measure", static_cast<std::size_t>(flip), static_cast<std::size_t>(options_.flips), ""});
            observe(flip);
        }
        return solve();
    }

private:
    Nanoseconds period() const { return source_.rhythm().period(); }

    /// Whatever the camera held back is gone after this.
    Frame much_later() {
        const CameraInfo& info = source_.info();
        const TimePoint earliest =
            clock_.now() + period() * (info.queue_depth + info.latency_frames + frames_to_be_sure);
        return source_.first_after(earliest, earliest + 16 * period() + to_nanoseconds(rig_.capture.frame_deadline));
    }

    void learn_pictures() {
        dark_ = to_picture(much_later());
        lamps_.light(options_.lamp);
        const Frame frame = much_later();
        lit_ = to_picture(frame);
        const Picture again = to_picture(much_later());
        lamps_.dark();
        full_scale_ = std::exp2(frame.bit_depth) - 1;
        const double signal = (mean(lit_) - mean(dark_)) / full_scale_;
        if (signal < rig_.capture.min_signal)
            throw InputError(fmt::format("lamp '{}' brightens the picture by {:.4f} of full scale only",
                                         rig_.lamps.at(options_.lamp.value).name, signal),
                             "choose another with --lamp, or raise exposure_ms of [camera]");
        noise_ = measure_noise(lit_, again, dark_, full_scale_);
    }

    /// One flip, at its own phase of the period, and every frame that it may have reached.
    void observe(int flip) {
        much_later();
        const ExposureClock& rhythm = source_.rhythm();
        const double phase = (flip + 0.5) / options_.flips;
        const TimePoint begin = rhythm.predicted(rhythm.first_from(clock_.now() + period() / 4)).begin;
        clock_.sleep_until(begin + to_nanoseconds(phase * Seconds(period())));
        const TimePoint before = clock_.now();
        lamps_.light(options_.lamp);
        const TimePoint on = before + (clock_.now() - before) / 2;
        const CameraInfo& info = source_.info();
        const TimePoint until = on + period() * (info.queue_depth + frames_to_be_sure + 4);
        while (auto frame = source_.next_until(until)) {
            if (!source_.in_rhythm()) continue;
            read(*frame, on);
        }
        lamps_.dark();
    }

    void read(const Frame& frame, TimePoint on) {
        const Picture picture = to_picture(frame);
        const double offset = to_seconds(source_.rhythm().stamp(frame.sequence) - on);
        for (const BandShare& band : band_shares({&dark_, nullptr, &picture, &lit_}, noise_, full_scale_))
            if (band.sigma < most_sigma && band.share > least_share && band.share < 1 - least_share)
                readings_.push_back({band.height, band.share, -offset});
        told_begin_ = frame.exposure.begin - frame.timestamp;
    }

    LatencyReport solve() const {
        if (readings_.size() < fewest_readings)
            throw InputError(fmt::format("only {} rows of frames showed a part of the lamp's light", readings_.size()),
                             "use a longer exposure, or a lamp that comes up faster");
        Eigen::MatrixXd equations(readings_.size(), 3);
        Eigen::VectorXd moments(readings_.size());
        for (std::size_t i = 0; i < readings_.size(); ++i) {
            const auto row = static_cast<Eigen::Index>(i);
            equations.row(row) << 1.0, readings_[i].height, -readings_[i].share;
            moments(row) = readings_[i].on_from_stamp;
        }
        const Eigen::Vector3d solution = equations.colPivHouseholderQr().solve(moments);
        const double rms = std::sqrt((equations * solution - moments).squaredNorm() /
                                     static_cast<double>(std::max<std::size_t>(readings_.size() - 3, 1)));
        const double readout = std::max(0.0, solution(1));
        LatencyReport report;
        report.camera = source_.info();
        report.exposure = Seconds(solution(2));
        report.residual = Seconds(rms);
        report.readings = readings_.size();
        report.told_begin = Seconds(told_begin_);
        report.timing.begin_from_stamp = to_nanoseconds(Seconds(solution(0) - solution(2)));
        report.timing.end_from_stamp = to_nanoseconds(Seconds(solution(0) + readout));
        report.timing.readout = to_nanoseconds(Seconds(readout));
        report.timing.margin = to_nanoseconds(Seconds(spreads * rms));
        return report;
    }

    const RigDescription& rig_;
    Clock& clock_;
    const LatencyOptions& options_;
    const WorkContext& work_;
    FrameSource source_;
    TimedLamps lamps_;
    Picture dark_;
    Picture lit_;
    NoiseModel noise_;
    double full_scale_ = 0;
    std::vector<Reading> readings_;
    Nanoseconds told_begin_{0};
};

}  // namespace

void LatencyOptions::validate() const {
    if (flips < 4 || flips > 1000)
        throw InputError(fmt::format("flips is {}; allowed: 4 to 1000", flips), "24 are enough for most cameras");
}

LatencyReport measure_latency(const RigDescription& rig, const CaptureDevices& devices, const LatencyOptions& options,
                              const WorkContext& work) {
    options.validate();
    if (options.lamp.value >= rig.lamps.size())
        throw InputError(
            fmt::format("lamp {} is not there; allowed: 0 to {}", options.lamp.value, rig.lamps.size() - 1),
            "choose a lamp that the rig has");
    return Measurement(rig, devices, options, work).run();
}

}  // namespace darkbox
