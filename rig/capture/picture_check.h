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
#include "rig/description/rig_description.h"

namespace darkbox {

/// A dark frame is not as dark as the first one: light that no shot asked for came into the box in between.
class DarkDiffers : public InputError {
public:
    using InputError::InputError;
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
    /// Two exposures in a row under one lamp; the first is the one to keep. It is brighter than the dark frame, shows
    /// the light of the second (it did not begin before the lamp was alone and steady), and is neither the same bits as
    /// an earlier frame nor the same picture as another lamp's. The first call also learns what the noise comes to.
    std::string accept_lit(const std::string& lamp, const Frame& frame, const Frame& confirming);

private:
    struct LitPicture {
        std::string lamp;
        Picture picture;
    };

    double share(double difference) const { return difference / (full_scale_ - black_level_); }
    void check_signal(double signal) const;
    void check_not_repeated(const Frame& frame, const Frame& confirming) const;
    NoiseModel check_steady(const Picture& first, const Picture& second) const;
    std::string check_not_another_lamp(const std::string& lamp, const Picture& picture, const NoiseModel& noise) const;
    std::string likely_stuck_lamp(const Picture& dark) const;

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
