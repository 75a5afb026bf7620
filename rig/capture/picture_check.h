#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "acquisition/camera/camera.h"
#include "acquisition/frame/error.h"
#include "rig/capture/picture.h"
#include "rig/capture/switch_witness.h"
#include "rig/description/rig_description.h"

namespace darkbox {

/// A dark frame is not as dark as the first one: light that no shot asked for came into the box in between.
class DarkDiffers : public InputError {
public:
    DarkDiffers(const std::string& what, const std::string& hint, bool late = false)
        : InputError(what, hint), late_(late) {}
    /// It is the picture of the last lamp, which burnt a moment ago: a frame from before, and no light to wonder at.
    bool late() const { return late_; }

private:
    bool late_;
};

/// Proves by the picture alone which lamp lit a frame: timestamps can lie, the picture cannot. Every accept function
/// returns what it found, in words, or throws InputError and remembers nothing.
/// Frames must have passed check_frame(). Thread-compatible.
class PictureCheck {
public:
    PictureCheck(const CameraInfo& camera, const CaptureDescription& limits);

    bool has_dark() const { return dark_.has_value(); }
    /// No brighter than the black level allows, and, but for the first, as dark as the first.
    std::string accept_dark(const Frame& frame);
    /// A frame lit by the lamp, and, unless a witness was heard, the exposure after it under the same lamp. The frame
    /// is brighter than the dark frame, shows the light of the confirming one (it did not begin before the lamp was
    /// alone and steady), and is neither the same bits as an earlier frame nor the same picture as another lamp's. The
    /// first call needs a confirming exposure: it learns what the noise comes to.
    std::string accept_lit(const std::string& lamp, const Frame& frame, const Frame* confirming = nullptr);

    /// Two exposures of one light have told what the noise comes to.
    bool knows_noise() const { return noise_.has_value(); }
    const std::optional<NoiseModel>& noise() const { return noise_; }

    /// What the frame tells that the switch spoiled; see switch_witness.h. `before`: the lamp of before, none for
    /// darkness; `after`: the frame after the switch, null where it was to darkness. No value when the noise or the
    /// picture of before is not known.
    std::optional<WitnessReport> hear(const std::optional<std::string>& before, const Frame& spoiled,
                                      const Frame* after, const ExpectedShares& expected,
                                      const WitnessTolerance& tolerance) const;

private:
    struct LitPicture {
        std::string lamp;
        Picture picture;
    };

    double share(double difference) const { return difference / (full_scale_ - black_level_); }
    void check_signal(double signal) const;
    void check_not_repeated(std::uint64_t hash, const Frame& frame, const Frame* confirming) const;
    NoiseModel check_steady(const std::string& lamp, const Picture& first, const Picture& second) const;
    void check_bands(const std::string& lamp, const Picture& first, const Picture& second,
                     const NoiseModel& noise) const;
    std::string check_not_another_lamp(const std::string& lamp, const Picture& picture, const NoiseModel& noise) const;
    std::string likely_stuck_lamp(const Picture& dark) const;
    bool is_the_last_lamp(const Picture& dark) const;

    double full_scale_;
    double black_level_;
    double min_signal_;
    double max_dark_;
    std::optional<Picture> dark_;
    std::optional<NoiseModel> noise_;
    std::deque<LitPicture> recent_;              ///< the latest lamps, newest last
    std::vector<LitPicture> shrunken_;           ///< every lamp
    std::map<std::uint64_t, std::string> seen_;  ///< hash of a frame's bytes -> its lamp
};

}  // namespace darkbox
