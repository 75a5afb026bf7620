#include "rig/capture/picture_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace darkbox {
namespace {

/// A late frame shows a lamp of the last few switches; more of them cost memory and find nothing.
constexpr std::size_t recent_lamps = 3;
/// A lamp's own flicker and drift from one frame to the next stay within this share.
constexpr double flicker = 0.03;
/// Two exposures of one light reach 1 in both ratios, with a known spread. Over that goes an allowance for a noise
/// model that is not perfect; it is larger for the sums over blocks, which find the faintest drift.
constexpr double spreads = 6.0;
struct Allowance {
    double pixels = 0.0;
    double blocks = 0.0;
};
/// To call a frame another lamp's it must be that picture and no other: lamps that look alike are good lamps.
constexpr Allowance same_picture{0.05, 0.5};
/// Within one lamp a little vibration does no harm; a share of another lamp reaches tens to thousands.
constexpr Allowance steady{1.0, 5.0};

/// Another lamp's light in a band of rows, beyond what noise explains.
constexpr double foreign_light = 0.002;

constexpr const char* unsteady_hint = "raise settle_ms of the lamp, look for flicker of its supply and for vibration";

/// A dark frame that a stuck lamp brightens looks like that lamp's picture.
constexpr double looks_alike = 0.9;

bool is_noise(const NoiseRatio& ratio, double allowance) {
    return ratio.value < 1.0 + allowance + spreads * ratio.sigma;
}

bool same_light(const Difference& d, const Allowance& allowance) {
    return std::abs(d.gain - 1.0) <= flicker && is_noise(d.pixels, allowance.pixels) &&
           is_noise(d.blocks, allowance.blocks);
}

}  // namespace

PictureCheck::PictureCheck(const CameraInfo& camera, const CaptureDescription& limits)
    : full_scale_(std::exp2(camera.bit_depth) - 1.0),
      black_level_(camera.black_level),
      min_signal_(limits.min_signal),
      max_dark_(limits.max_dark) {}

std::string PictureCheck::accept_dark(const Frame& frame) {
    Picture picture = to_picture(frame);
    const double above_black = share(mean(picture) - black_level_);
    if (!dark_ && above_black > max_dark_)
        throw InputError(fmt::format("the dark frame is bright: its mean is {:.4f} of full scale above the black "
                                     "level, at most {:.4f} is allowed",
                                     above_black, max_dark_),
                         "close the door and look for a lamp that is stuck on; for a camera with a raised black "
                         "level set max_dark of [capture]");
    if (!dark_) {
        dark_ = std::move(picture);
        return fmt::format("mean {:.4f} of full scale above the black level", above_black);
    }
    const double change = share(mean(picture) - mean(*dark_));
    if (std::abs(change) > min_signal_)
        throw DarkDiffers(fmt::format("the dark frame differs from the first one by {:+.4f} of full scale, at most "
                                      "{:.4f} is allowed{}",
                                      change, min_signal_, likely_stuck_lamp(picture)),
                          "look for a lamp that is stuck on or a door that was opened", is_the_last_lamp(picture));
    return fmt::format("mean {:.4f} of full scale above the black level, {:+.4f} against the first dark frame",
                       above_black, change);
}

std::string PictureCheck::accept_lit(const std::string& lamp, const Frame& frame, const Frame* confirming) {
    Picture picture = to_picture(frame);
    const double signal = share(mean(picture) - mean(*dark_));
    check_signal(signal);
    const std::uint64_t hash = hash_of(frame.pixels);
    check_not_repeated(hash, frame, confirming);
    const NoiseModel noise = confirming ? check_steady(lamp, picture, to_picture(*confirming)) : noise_.value();
    const std::string unlike = check_not_another_lamp(lamp, picture, noise);

    noise_ = noise;
    seen_.emplace(hash, lamp);
    if (confirming) seen_.emplace(hash_of(confirming->pixels), lamp);
    shrunken_.push_back({lamp, shrink(picture)});
    std::erase_if(recent_, [&](const LitPicture& lit) { return lit.lamp == lamp; });
    recent_.push_back({lamp, std::move(picture)});
    if (recent_.size() > recent_lamps) recent_.pop_front();
    return fmt::format("mean {:.4f} of full scale above the dark frame{}", signal, unlike);
}

std::optional<WitnessReport> PictureCheck::hear(const std::optional<std::string>& before, const Frame& spoiled,
                                                const Frame* after, const ExpectedShares& expected,
                                                const WitnessTolerance& tolerance) const {
    if (!noise_) return std::nullopt;
    const auto lit =
        std::find_if(recent_.begin(), recent_.end(), [&](const LitPicture& p) { return p.lamp == before; });
    if (before && lit == recent_.end()) return std::nullopt;
    const Picture picture_spoiled = to_picture(spoiled);
    const Picture picture_after = after ? to_picture(*after) : Picture();
    return hear_witness({&*dark_, before ? &lit->picture : nullptr, &picture_spoiled, after ? &picture_after : nullptr},
                        *noise_, full_scale_, expected, tolerance);
}

void PictureCheck::check_signal(double signal) const {
    if (signal >= min_signal_) return;
    throw InputError(fmt::format("the frame is as dark as the dark frame: its mean is {:+.4f} of full scale above it, "
                                 "at least {:.4f} is expected",
                                 signal, min_signal_),
                     "check the lamp, its supply and its wiring; for a dim lamp raise exposure_ms of [camera]");
}

void PictureCheck::check_not_repeated(std::uint64_t hash, const Frame& frame, const Frame* confirming) const {
    constexpr const char* hint = "the camera or its driver delivers a picture twice; plug it in again or update it";
    const auto earlier = seen_.find(hash);
    if (earlier != seen_.end())
        throw InputError(fmt::format("the frame repeats the frame of lamp '{}' bit for bit", earlier->second), hint);
    if (confirming && frame.pixels == confirming->pixels)
        throw InputError("two exposures in a row are the same bit for bit", hint);
}

NoiseModel PictureCheck::check_steady(const std::string& lamp, const Picture& first, const Picture& second) const {
    const NoiseModel noise = noise_ ? *noise_ : measure_noise(first, second, *dark_, full_scale_);
    const Difference difference = compare(first, second, *dark_, noise);
    if (!same_light(difference, steady))
        throw InputError(
            fmt::format("two exposures in a row under the lamp differ: {:.3f} times the brightness, {:.1f} "
                        "times the noise; the first began before the lamp was alone and steady",
                        difference.gain, difference.pixels.value),
            unsteady_hint);
    check_bands(lamp, first, second, noise);
    return noise;
}

/// A few rows that were exposed too early hardly show in the whole picture, but in their band.
void PictureCheck::check_bands(const std::string& lamp, const Picture& first, const Picture& second,
                               const NoiseModel& noise) const {
    const auto before =
        std::find_if(recent_.rbegin(), recent_.rend(), [&](const LitPicture& lit) { return lit.lamp != lamp; });
    const Picture* earlier = before == recent_.rend() ? nullptr : &before->picture;
    const BandLights lights = compare_bands({&*dark_, earlier, &first, &second}, noise, full_scale_);
    if (lights.most_before > foreign_light || lights.most_missing > flicker)
        throw InputError(
            fmt::format("some rows of the first of two exposures hold {:.1f} % of another lamp's light and lack {:.1f} "
                        "% of their own; it began before the lamp was alone and steady",
                        100 * lights.most_before, 100 * lights.most_missing),
            unsteady_hint);
}

std::string PictureCheck::check_not_another_lamp(const std::string& lamp, const Picture& picture,
                                                 const NoiseModel& noise) const {
    std::string found;
    for (const LitPicture& other : recent_) {
        if (other.lamp == lamp) continue;
        const Difference difference = compare(picture, other.picture, *dark_, noise);
        if (same_light(difference, same_picture))
            throw InputError(fmt::format("the frame shows the picture of lamp '{}': the two differ by no more than "
                                         "noise ({:.2f} times)",
                                         other.lamp, difference.pixels.value),
                             "the camera delivered an old frame, or one lamp is wired for the other: check the wiring "
                             "of both");
        found = fmt::format("; differs from lamp '{}' by {:.1f} times its noise", other.lamp,
                            std::sqrt(std::max(difference.pixels.value, difference.blocks.value)));
    }
    return found;
}

bool PictureCheck::is_the_last_lamp(const Picture& dark) const {
    return noise_ && !recent_.empty() &&
           same_light(compare(dark, recent_.back().picture, *dark_, *noise_), same_picture);
}

std::string PictureCheck::likely_stuck_lamp(const Picture& dark) const {
    if (!dark_) return "";
    const Picture small = shrink(dark);
    const Picture small_dark = shrink(*dark_);
    std::string lamp;
    double best = looks_alike;
    for (const LitPicture& lit : shrunken_) {
        const double alike = correlation(lit.picture, small, small_dark);
        if (alike < best) continue;
        best = alike;
        lamp = lit.lamp;
    }
    return lamp.empty() ? "" : fmt::format("; it looks lit by lamp '{}'", lamp);
}

}  // namespace darkbox
