#include "rig/health/rig_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <opencv2/imgproc.hpp>

#include "acquisition/frame/error.h"
#include "processing/calibration/ball_search.h"
#include "rig/health/flicker.h"
#include "rig/health/lamp_spots.h"
#include "rig/health/linearity.h"
#include "rig/health/movement.h"
#include "rig/health/probe.h"
#include "rig/health/sharpness.h"

namespace darkbox {
namespace {

constexpr double brief = 1.0 / 32;        ///< of the exposure: lamps' mirror images do not clip in it
constexpr double ball_picture_px = 1e6;   ///< pictures of the ball are made no larger, all lamps' are held at once
constexpr double ball_margin = 1.15;      ///< of its radius
constexpr double brightest_share = 0.01;  ///< of the pixels, whose signal tells the linearity
constexpr double aimed_level = 0.9;       ///< of full scale, at the sweep's longest exposure
constexpr double most_longer = 4;         ///< than the exposure of rig.toml
constexpr double least_level = 0.3;       ///< of full scale: a sweep that reaches less far tells little
constexpr std::array sweep{1.0 / 16, 1.0 / 8, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875, 1.0};
constexpr int looks_averaged = 2;

/// What the frames of one lamp came to.
struct LampLook {
    cv::Mat1f mean;     ///< of the frames; 1 = full scale, the dark frame not taken away
    cv::Mat1b clipped;  ///< in the first
    std::optional<Flicker> flicker;
};

class Check {
public:
    Check(const RigDescription& rig, const CaptureDevices& devices, const RigCheckOptions& options,
          const WorkContext& work)
        : rig_(rig), options_(options), work_(work), probe_(rig, devices, work) {}

    RigReport run() {
        dark_ = look_at(std::nullopt).mean;
        for (std::uint32_t i = 0; i < rig_.lamps.size(); ++i) {
            work_.tell({"check", i, rig_.lamps.size() + 2, rig_.lamps[i].name});
            see(i, look_at(LampId{i}));
        }
        tell("ball");
        look_at_the_ball();
        tell_clipping();
        tell("exposures");
        tell_linearity();
        tell_focus();
        tell_movement();
        return std::move(report_);
    }

private:
    const std::string& name_of(std::size_t lamp) const { return rig_.lamps.at(lamp).name; }
    void tell(const char* what) const { work_.tell({"check", rig_.lamps.size(), rig_.lamps.size() + 2, what}); }

    LampLook look_at(std::optional<LampId> lamp) {
        LampLook look;
        FlickerMeter meter;
        int count = 0;
        probe_.take(lamp, rig_.camera.exposure, options_.frames, [&](const Frame& frame) {
            const Luminance picture = luminance_of(frame);
            if (count++ == 0) {
                look.mean = cv::Mat1f(picture.light.size(), 0.0F);
                look.clipped = picture.clipped;
            }
            look.mean += picture.light;
            meter.add(picture);
        });
        look.mean /= count;
        look.flicker = meter.result();
        return look;
    }

    void see(std::uint32_t lamp, const LampLook& look) {
        const double signal = cv::mean(look.mean - dark_)[0];
        signals_.push_back(signal);
        ball_looks_.push_back({shrunken(look.mean), rig_.camera.exposure.count()});
        clipped_.push_back(look.clipped);
        if (signal < rig_.capture.min_signal) {
            dead_.push_back(lamp);
            add({"lamp", name_of(lamp), 100 * signal, 100 * rig_.capture.min_signal, "%", RigVerdict::failed,
                 "it is dead: its frame is no brighter than the dark one",
                 "check its wiring and its output in rig.toml"});
            return;
        }
        if (!first_lamp_) {
            first_lamp_ = LampId{lamp};
            first_ = look;
        }
        tell_flicker(lamp, look.flicker);
        if (best_.empty() || signal > best_signal_) {
            best_ = look.mean;
            best_lamp_ = LampId{lamp};
            best_signal_ = signal;
        }
    }

    void tell_flicker(std::size_t lamp, const std::optional<Flicker>& flicker) {
        RigFinding finding{"flicker", name_of(lamp), std::nullopt, 100 * options_.most_flicker, "%"};
        if (!flicker) {
            finding.verdict = RigVerdict::untold;
            finding.words = "max_on_s leaves no time for three frames, or nothing is lit without clipping";
            return add(finding);
        }
        finding.value = 100 * flicker->rms;
        finding.words = fmt::format("from exposure to exposure, over {} of them", flicker->frames);
        finding.remedy = "drive it by direct current, or make exposure_ms a whole number of its pulse widths' periods";
        if (flicker->rms > options_.most_flicker) {
            finding.verdict = RigVerdict::failed;
        } else if (flicker->noise > options_.most_flicker) {
            finding.verdict = RigVerdict::untold;
            finding.words = fmt::format("noise alone comes to {:.2g} %: more light is needed", 100 * flicker->noise);
        }
        add(finding);
    }

    cv::Mat1f shrunken(const cv::Mat1f& picture) const {
        const int factor = shrink_factor();
        cv::Mat1f small;
        cv::resize(picture, small, {picture.cols / factor, picture.rows / factor}, 0, 0, cv::INTER_AREA);
        return small;
    }
    int shrink_factor() const {
        return std::max(1,
                        static_cast<int>(std::ceil(std::sqrt(static_cast<double>(dark_.total()) / ball_picture_px))));
    }

    void look_at_the_ball() {
        std::vector<cv::Mat3f> frames;
        for (const BallLook& look : ball_looks_) {
            cv::Mat3f& frame = frames.emplace_back();
            cv::merge(std::vector<cv::Mat>{look.light, look.light, look.light}, frame);
        }
        const std::vector<Ball> balls = find_balls(frames);
        if (balls.empty()) {
            add({"leak", "", std::nullopt, 100 * options_.most_leak, "%", RigVerdict::untold,
                 "no mirror ball was found, so neither leaks nor dim lamps can be told"});
            return;
        }
        for (const Ball& ball : balls) balls_.push_back(ball);
        std::vector<BallLook> briefly;
        for (std::uint32_t i = 0; i < rig_.lamps.size(); ++i) {
            const Probe::Look look = probe_.look(LampId{i}, brief * rig_.camera.exposure);
            briefly.push_back({shrunken(look.picture.light), look.exposure.count()});
        }
        const auto spots = lamp_spots(ball_looks_, briefly, balls.front());
        tell_strengths(spots);
        const BallLook dark{shrunken(dark_), rig_.camera.exposure.count()};
        tell_leaks(find_leaks(ball_looks_, dark, spots, balls.front(), options_.most_leak), spots);
    }

    void tell_strengths(const std::vector<std::optional<LampSpot>>& spots) {
        std::vector<double> strengths;
        for (const auto& spot : spots)
            if (spot) strengths.push_back(spot->strength);
        if (strengths.size() < 3) return;
        std::nth_element(strengths.begin(), strengths.begin() + static_cast<std::ptrdiff_t>(strengths.size() / 2),
                         strengths.end());
        const double median = strengths[strengths.size() / 2];
        for (std::size_t i = 0; i < spots.size(); ++i) {
            if (std::find(dead_.begin(), dead_.end(), i) != dead_.end()) continue;
            RigFinding finding{"lamp", name_of(i), std::nullopt, 100 * options_.least_lamp, "%"};
            if (spots[i]) {
                const double share = spots[i]->strength / median;
                finding.value = 100 * share;
                finding.words = fmt::format("of the lamps' median light, by its image on the ball{}",
                                            spots[i]->clipped ? "; it clips, there is more" : "");
                finding.remedy = "clean it, check its driver's current, or replace it";
                if (share < options_.least_lamp && !spots[i]->clipped) finding.verdict = RigVerdict::failed;
            } else {
                finding.verdict = RigVerdict::untold;
                finding.words = "the ball does not show it";
            }
            add(finding);
        }
    }

    void tell_leaks(const std::vector<Leak>& leaks, const std::vector<std::optional<LampSpot>>& spots) {
        for (const Leak& leak : leaks)
            add({"leak", name_of(leak.leaking), 100 * leak.share, 100 * options_.most_leak, "%", RigVerdict::failed,
                 fmt::format(
                     "it glows while {}{}",
                     leak.commanded ? "only " + name_of(*leak.commanded) + " is to burn" : "all are to be dark",
                     spots[leak.leaking]->clipped ? "; its own image clips, so that this is the most it can be" : ""),
                 "look for crosstalk between the drivers, a missing pull-down, or light between the lamps' housings"});
        if (leaks.empty())
            add({"leak", "", std::nullopt, 100 * options_.most_leak, "%", RigVerdict::good,
                 "no lamp shows on the ball while another burns, or in the dark"});
    }

    /// 255 on or off the balls.
    cv::Mat1b mask(bool on_the_ball) const {
        cv::Mat1b mask(dark_.size(), on_the_ball ? uchar{0} : uchar{255});
        const double factor = shrink_factor();
        for (const Ball& ball : balls_)
            cv::circle(mask, cv::Point(cv::Point2d(ball.x, ball.y) * factor),
                       static_cast<int>((on_the_ball ? 1.0 : ball_margin) * ball.radius * factor),
                       cv::Scalar(on_the_ball ? 255 : 0), cv::FILLED);
        return mask;
    }

    void tell_clipping() {
        const cv::Mat1b object = mask(false);
        const double pixels = std::max(1, cv::countNonZero(object));
        std::size_t worst = 0;
        double most = 0;
        for (std::size_t i = 0; i < clipped_.size(); ++i) {
            const double share = cv::countNonZero(clipped_[i] & object) / pixels;
            if (share > most) worst = i;
            most = std::max(most, share);
        }
        const bool failed = most > options_.most_clipped;
        add({"clipping", most > 0 ? name_of(worst) : "", 100 * most, 100 * options_.most_clipped, "%",
             failed ? RigVerdict::failed : RigVerdict::good,
             "of the pixels off the ball are at full scale, at the worst lamp",
             "shorten exposure_ms, or polarise highlights away"});
    }

    /// The pixels that are brightest without clipping, picked on a frame that is not measured: picked on the same, they
    /// would be those on which noise lies upwards.
    cv::Mat1b brightest() const {
        const cv::Mat1b object = mask(false);
        std::vector<float> values;
        for (int v = 0; v < best_.rows; ++v)
            for (int u = 0; u < best_.cols; ++u)
                if (object(v, u) && best_(v, u) < aimed_level) values.push_back(best_(v, u));
        if (values.empty()) return {};
        const auto place =
            values.end() - 1 - static_cast<std::ptrdiff_t>(brightest_share * static_cast<double>(values.size()));
        std::nth_element(values.begin(), place, values.end());
        return cv::Mat1b(object & (best_ >= *place) & (best_ < aimed_level));
    }

    double signal(std::optional<LampId> lamp, Seconds exposure, const cv::Mat1b& pixels, Seconds& in_effect) {
        double sum = 0;
        for (int i = 0; i < looks_averaged; ++i) {
            const Probe::Look look = probe_.look(lamp, exposure);
            in_effect = look.exposure;
            sum += cv::mean(look.picture.light, pixels)[0];
        }
        return sum / looks_averaged;
    }

    void tell_linearity() {
        RigFinding finding{"linearity", "", std::nullopt, 100 * options_.most_deviation, "%"};
        const cv::Mat1b pixels = best_.empty() ? cv::Mat1b() : brightest();
        finding.verdict = RigVerdict::untold;
        finding.words = "nothing in the picture is lit without clipping";
        if (pixels.empty()) return add(finding);
        const LampDescription& lamp = rig_.lamps.at(best_lamp_.value);
        const double level = cv::mean(best_ - dark_, pixels)[0];
        const double bearable = (lamp.max_on - lamp.settle) / (16 * rig_.camera.exposure);
        const Seconds longest =
            std::clamp(std::min(aimed_level / level, bearable), 0.1, most_longer) * rig_.camera.exposure;
        std::vector<ExposedSignal> points;
        for (const double share : sweep) {
            ExposedSignal point;
            Seconds ignored{0};
            point.signal = signal(best_lamp_, share * longest, pixels, point.exposure) -
                           signal(std::nullopt, share * longest, pixels, ignored);
            points.push_back(point);
        }
        const Linearity found = measure_linearity(points);
        finding.words = fmt::format("the brightest pixels reach {:.0f} % of full scale only: more light is needed",
                                    100 * found.top);
        if (found.top < least_level) return add(finding);
        finding.value = 100 * found.deviation;
        finding.verdict = found.deviation > options_.most_deviation ? RigVerdict::failed : RigVerdict::good;
        finding.words = fmt::format("off the line, most at {:.4g} ms; {} exposures up to {:.0f} % of full scale",
                                    1000 * found.worst.count(), points.size(), 100 * found.top);
        finding.remedy =
            "switch gamma and contrast off, choose a raw format, keep exposures below the bend; darkbox rig "
            "check --camera shows what is in effect";
        add(finding);
    }

    void tell_focus() {
        RigFinding finding{"focus", "", std::nullopt, options_.most_blur_px, "px"};
        if (!best_.empty()) finding.value = measure_blur(best_, mask(false));
        finding.verdict = RigVerdict::untold;
        finding.words = "no edge stands out on the object";
        if (finding.value) {
            finding.verdict = *finding.value > options_.most_blur_px ? RigVerdict::failed : RigVerdict::good;
            finding.words = "blur at the sharpest edges (standard deviation)";
            finding.remedy = "focus anew on the object, or close the aperture";
        }
        add(finding);
    }

    /// The first lamp's light once more, at the end of all that was done.
    void tell_movement() {
        RigFinding finding{"movement", "", std::nullopt, options_.most_movement_px, "px"};
        finding.verdict = RigVerdict::untold;
        finding.words = "no lamp shows anything to tell it by";
        if (!first_lamp_) return add(finding);
        const LampLook last = look_at(first_lamp_);
        std::vector<Ball> balls = balls_;
        for (Ball& ball : balls) {
            ball.x *= shrink_factor();
            ball.y *= shrink_factor();
            ball.radius *= shrink_factor();
        }
        const auto movement =
            measure_movement(first_.mean, last.mean, cv::Mat1b(~(first_.clipped | last.clipped)), balls);
        finding.words = "too little in the picture has an edge";
        if (!movement) return add(finding);
        finding.value = movement->object.length();
        finding.words = fmt::format("from the first frame to the last (noise {:.1g} px)", movement->object.sigma_px);
        finding.remedy = "look for what is loose: object, camera, tripod, table; let it come to rest";
        const bool failed = movement->moved(options_.most_movement_px);
        if (failed) finding.words = movement->words() + ", from the first frame to the last";
        const bool noisy = 3 * movement->object.sigma_px > options_.most_movement_px;
        finding.verdict = failed ? RigVerdict::failed : noisy ? RigVerdict::untold : RigVerdict::good;
        add(finding);
    }

    void add(RigFinding finding) { report_.findings.push_back(std::move(finding)); }

    const RigDescription& rig_;
    const RigCheckOptions& options_;
    const WorkContext& work_;
    Probe probe_;
    cv::Mat1f dark_;
    std::vector<double> signals_;
    std::vector<BallLook> ball_looks_;
    std::vector<cv::Mat1b> clipped_;
    std::vector<std::size_t> dead_;
    std::vector<Ball> balls_;           ///< in shrunken pictures
    std::optional<LampId> first_lamp_;  ///< that is not dead
    LampLook first_;
    cv::Mat1f best_;  ///< under the lamp that lights most
    LampId best_lamp_;
    double best_signal_ = 0;
    RigReport report_;
};

void require(bool holds, const char* field, double value, const char* range) {
    if (!holds)
        throw InputError(fmt::format("{} is {}; allowed: {}", field, value, range), "choose a value in that range");
}

}  // namespace

void RigCheckOptions::validate() const {
    require(frames >= 3 && frames <= 1000, "frames", frames, "3 to 1000");
    for (const auto& [field, value] : {std::pair{"most_deviation", most_deviation},
                                       std::pair{"most_flicker", most_flicker}, std::pair{"most_leak", most_leak},
                                       std::pair{"least_lamp", least_lamp}, std::pair{"most_clipped", most_clipped}})
        require(value > 0 && value < 1, field, value, "above 0, below 1");
    require(most_blur_px > 0, "most_blur_px", most_blur_px, "above 0");
    require(most_movement_px > 0, "most_movement_px", most_movement_px, "above 0");
}

RigReport check_rig(const RigDescription& rig, const CaptureDevices& devices, const RigCheckOptions& options,
                    const WorkContext& work) {
    options.validate();
    return Check(rig, devices, options, work).run();
}

}  // namespace darkbox
