#include "rig/capture/meter.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "acquisition/frame/error.h"
#include "rig/capture/metered_picture.h"
#include "rig/capture/timed_lamps.h"

namespace darkbox {
namespace {

constexpr double lowest_level = 0.80;
constexpr double wanted_level = 0.85;
constexpr double highest_level = 0.90;
/// From here on samples may be clipped, and tell no more how bright it is.
constexpr double clipped_level = 0.97;
constexpr double when_clipped = 0.25;
/// A level that is mostly noise must not be believed all the way.
constexpr double longest_step = 16;
/// Below this a level is noise; from telling_level on a picture shows what is the object.
constexpr double faintest_level = 0.001;
constexpr double telling_level = 0.2;
constexpr int most_rounds = 16;
/// A lamp that is fainter than this beside the brightest one does not become it by another exposure.
constexpr double worth_a_look = 0.7;

class Meter {
public:
    Meter(const RigDescription& rig, std::vector<LampId> lamps, const CaptureDevices& devices, const WorkContext& work,
          const TimingLookup& timings)
        : rig_(rig), lamps_(std::move(lamps)), devices_(devices), work_(work), timings_(timings) {
        for (const LampId lamp : lamps_) longest_ = std::min(longest_, longest_under(lamp));
    }

    Metering find() {
        Seconds exposure = allowed(rig_.camera.exposure), before{0};
        for (int round = 0; round < most_rounds; ++round) {
            measure(exposure);
            if (found_.level >= lowest_level && found_.level <= highest_level) return found_;
            const double ratio = clipped() ? when_clipped : wanted_level / std::max(found_.level, faintest_level);
            const Seconds next = allowed(exposure * std::min(ratio, longest_step));
            if (next == exposure || found_.exposure == before) {
                if (found_.level <= highest_level && fits_no_better(next)) return found_;
                refuse();
            }
            exposure = next;
            before = found_.exposure;
        }
        throw InputError(fmt::format("metering came to no end: at {} ms the object reaches {:.1f} % of full scale",
                                     found_.exposure.count() * 1000, found_.level * 100),
                         "look for light that changes, or set exposure_ms of [camera]");
    }

private:
    Seconds longest_under(LampId id) const {
        const LampDescription& lamp = rig_.lamps.at(id.value);
        return (lamp.max_on - lamp.settle) / 4;  // frames that are held back come before the one that counts
    }

    /// The nearest exposure that camera, lamps and flicker allow, not longer than asked where it is a matter of
    /// flicker.
    Seconds allowed(Seconds wanted) const {
        const Seconds inside = std::clamp(wanted, shortest_, longest_);
        if (!rig_.flicker_hz) return inside;
        constexpr double rounding = 1e-6;
        const double least = std::max(1.0, std::ceil(shortest_.count() * *rig_.flicker_hz - rounding));
        const double most = std::floor(longest_.count() * *rig_.flicker_hz + rounding);
        const double highest = highest_level / wanted_level;
        const double nearest = std::round(inside.count() * *rig_.flicker_hz);
        const double fitting = nearest > inside.count() * highest * *rig_.flicker_hz ? nearest - 1 : nearest;
        return Seconds(std::max(std::min(fitting, most), least) / *rig_.flicker_hz);
    }

    /// The flicker's periods, or steps that the camera counts in, let nothing come nearer; not that it ends here.
    bool fits_no_better(Seconds exposure) const {
        if (!rig_.flicker_hz) return exposure > shortest_ && exposure < longest_;
        return found_.level * (exposure.count() + 1 / *rig_.flicker_hz) / exposure.count() > highest_level;
    }

    bool clipped() const { return found_.level >= clipped_level; }

    void measure(Seconds exposure) {
        FrameSource source(devices_.camera, devices_.clock, {exposure, rig_.camera.gain}, work_, timings_);
        TimedLamps lamps(devices_.lamps, devices_.clock, rig_);
        learn_range(source.info());
        std::vector<std::vector<float>> pictures;
        for (const LampId lamp : lamps_) {
            work_.tell({"metering", pictures.size(), lamps_.size(),
                        fmt::format("{} at {:.3g} ms", rig_.lamps.at(lamp.value).name, exposure.count() * 1000)});
            pictures.push_back(look_patiently(source, lamps, lamp));
        }
        if (!object_is_sure_) object_ = object_pixels(pictures);
        judge(source.info().controls.exposure, pictures);
        if (clipped() || found_.level < telling_level) return;
        object_is_sure_ = true;
        leave_out_faint_lamps();
    }

    std::vector<float> look(FrameSource& source, TimedLamps& lamps, LampId id) {
        const LampDescription& lamp = rig_.lamps.at(id.value);
        const Nanoseconds frame = to_nanoseconds(std::max(source.info().frame_period, source.info().controls.exposure));
        lamps.light(id);
        const TimePoint on = devices_.clock.now();
        const TimePoint steady = std::max(on, lamps.timeline().steady_from());
        const TimePoint patience =
            steady + frame * (source.info().queue_depth + 4) + to_nanoseconds(rig_.capture.frame_deadline);
        const Frame picture = source.first_after(steady, std::min(patience, on + to_nanoseconds(lamp.max_on)));
        lamps.dark();
        ++frames_;
        return metered_pixels(picture);
    }

    /// As a shot of the plan is: again, at most rig.capture.tries times.
    std::vector<float> look_patiently(FrameSource& source, TimedLamps& lamps, LampId id) {
        for (int number = 1;; ++number) {
            try {
                source.recover(to_nanoseconds(rig_.capture.frame_deadline));
                return look(source, lamps, id);
            } catch (const DeviceError&) {
                lamps.dark();
                if (number == rig_.capture.tries) throw;
            }
        }
    }

    void judge(Seconds exposure, const std::vector<std::vector<float>>& pictures) {
        levels_.clear();
        for (const std::vector<float>& picture : pictures) levels_.push_back(object_level(picture, object_));
        const auto brightest = std::max_element(levels_.begin(), levels_.end());
        const auto place = static_cast<std::size_t>(brightest - levels_.begin());
        found_ = {exposure, *brightest, rig_.lamps.at(lamps_[place].value).name, frames_};
    }

    void leave_out_faint_lamps() {
        std::vector<LampId> bright;
        for (std::size_t i = 0; i < lamps_.size(); ++i)
            if (levels_[i] >= worth_a_look * found_.level) bright.push_back(lamps_[i]);
        lamps_ = std::move(bright);
    }

    void learn_range(const CameraInfo& camera) {
        if (!camera.exposure_range) return;
        shortest_ = camera.exposure_range->shortest;
        longest_ = std::min(longest_, camera.exposure_range->longest);
    }

    [[noreturn]] void refuse() const {
        const bool dark = found_.level < lowest_level;
        throw InputError(fmt::format("the object is too {} to be metered: under lamp '{}', its brightest, it reaches "
                                     "{:.1f} % of full scale at the {} exposure that camera and lamps allow, {:.4g} ms",
                                     dark ? "dark" : "bright", found_.lamp, found_.level * 100,
                                     dark ? "longest" : "shortest", found_.exposure.count() * 1000),
                         dark ? "open the lens, raise gain of [camera], or max_on_s of the lamps if they bear it"
                              : "close the lens, or lower gain of [camera]");
    }

    const RigDescription& rig_;
    std::vector<LampId> lamps_;  ///< those worth a look
    const CaptureDevices& devices_;
    const WorkContext& work_;
    const TimingLookup& timings_;
    Seconds shortest_{1e-6};
    Seconds longest_{std::numeric_limits<double>::infinity()};
    std::vector<bool> object_;
    bool object_is_sure_ = false;  ///< neither clipping nor noise blurred its edge
    std::vector<double> levels_;   ///< of the lamps worth a look
    Metering found_;
    int frames_ = 0;
};

}  // namespace

std::string Metering::words() const {
    return fmt::format(
        "metered: exposure {:.3f} ms; under lamp '{}', its brightest, the object's 99.9th percentile is {:.1f} % of "
        "full "
        "scale; {} frames taken for it, none kept",
        exposure.count() * 1000, lamp, level * 100, frames);
}

Metering meter_exposure(const RigDescription& rig, const std::vector<LampId>& lamps, const CaptureDevices& devices,
                        const WorkContext& work, const TimingLookup& timings) {
    const DarkOnExit dark_on_exit(devices.lamps);
    return Meter(rig, lamps, devices, work, timings).find();
}

}  // namespace darkbox
