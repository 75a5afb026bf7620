#include "acquisition/camera/video_controls.h"

#include <fmt/format.h>
#include <linux/videodev2.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <optional>

#include "acquisition/frame/error.h"

namespace darkbox {
namespace {

constexpr VideoRequest query{VIDIOC_QUERYCTRL, "VIDIOC_QUERYCTRL"};
constexpr VideoRequest get{VIDIOC_G_CTRL, "VIDIOC_G_CTRL"};
constexpr VideoRequest set{VIDIOC_S_CTRL, "VIDIOC_S_CTRL"};

/// V4L2_CID_EXPOSURE_ABSOLUTE counts in these.
constexpr Seconds exposure_unit{100e-6};
/// A camera may round an exposure to its rows; more than this is another exposure.
constexpr double exposure_tolerance = 0.1;

enum class Neutral { value, lowest, by_default };

struct Control {
    std::uint32_t id = 0;
    const char* name = "";
    Neutral neutral = Neutral::value;
    std::int32_t value = 0;
};

/// Automatisms first: as long as they are on, others are out of reach.
constexpr std::array neutral_controls{
    Control{V4L2_CID_EXPOSURE_AUTO, "exposure_auto", Neutral::value, V4L2_EXPOSURE_MANUAL},
    Control{V4L2_CID_EXPOSURE_AUTO_PRIORITY, "exposure_auto_priority"},
    Control{V4L2_CID_AUTOGAIN, "autogain"},
    Control{V4L2_CID_ISO_SENSITIVITY_AUTO, "iso_sensitivity_auto", Neutral::value, V4L2_ISO_SENSITIVITY_MANUAL},
    Control{V4L2_CID_AUTO_WHITE_BALANCE, "auto_white_balance"},
    Control{V4L2_CID_FOCUS_AUTO, "focus_auto"},
    Control{V4L2_CID_AUTOBRIGHTNESS, "autobrightness"},
    Control{V4L2_CID_HUE_AUTO, "hue_auto"},
    Control{V4L2_CID_CHROMA_AGC, "chroma_agc"},
    Control{V4L2_CID_WIDE_DYNAMIC_RANGE, "wide_dynamic_range"},
    Control{V4L2_CID_IMAGE_STABILIZATION, "image_stabilization"},
    Control{V4L2_CID_POWER_LINE_FREQUENCY, "power_line_frequency", Neutral::value,
            V4L2_CID_POWER_LINE_FREQUENCY_DISABLED},
    Control{V4L2_CID_COLORFX, "color_effects", Neutral::value, V4L2_COLORFX_NONE},
    Control{V4L2_CID_BACKLIGHT_COMPENSATION, "backlight_compensation", Neutral::lowest},
    Control{V4L2_CID_SHARPNESS, "sharpness", Neutral::lowest},
    Control{V4L2_CID_BRIGHTNESS, "brightness", Neutral::by_default},
    Control{V4L2_CID_CONTRAST, "contrast", Neutral::by_default},
    Control{V4L2_CID_SATURATION, "saturation", Neutral::by_default},
    Control{V4L2_CID_HUE, "hue", Neutral::by_default},
    Control{V4L2_CID_GAMMA, "gamma", Neutral::value, 100},  // UVC 1.5, 4.2.2.3.9: in hundredths, so 1.0
};
constexpr Control exposure_control{V4L2_CID_EXPOSURE_ABSOLUTE, "exposure_absolute"};
constexpr Control gain_control{V4L2_CID_GAIN, "gain"};

/// No value for a control that the camera does not have.
std::optional<v4l2_queryctrl> find(VideoNode& node, const Control& control) {
    v4l2_queryctrl found{};
    found.id = control.id;
    const int error = node.ask(query, found);
    if (error == EINVAL || error == ENOTTY) return std::nullopt;
    if (error != 0) node.fail(query.name, error);
    if ((found.flags & V4L2_CTRL_FLAG_DISABLED) != 0) return std::nullopt;
    return found;
}

[[noreturn]] void throw_does_not_hold(const VideoNode& node, const Control& control, const std::string& what) {
    throw DeviceError(
        fmt::format("the control {} of {} {}", control.name, node.path(), what),
        "another program may change it: stop it; else update the camera's firmware or use another camera");
}

std::int32_t read(VideoNode& node, const Control& control) {
    v4l2_control value{control.id, 0};
    node.call(get, value);
    return value.value;
}

void write(VideoNode& node, const Control& control, const v4l2_queryctrl& range, std::int32_t wanted) {
    if ((range.flags & V4L2_CTRL_FLAG_READ_ONLY) != 0) return;  // the read-back decides
    v4l2_control value{control.id, wanted};
    const int error = node.ask(set, value);
    if (error == EINVAL || error == ERANGE || error == EACCES || error == EBUSY)
        throw_does_not_hold(
            node, control,
            fmt::format("cannot be set to {}; its range is {} to {}", wanted, range.minimum, range.maximum));
    if (error != 0) node.fail(set.name, error);
}

std::int32_t target(const Control& control, const v4l2_queryctrl& range) {
    if (control.neutral == Neutral::lowest) return range.minimum;
    if (control.neutral == Neutral::by_default) return range.default_value;
    // A gamma that is not counted in hundredths: what the maker calls neutral.
    if (control.id == V4L2_CID_GAMMA && (range.minimum > control.value || range.maximum < control.value))
        return range.default_value;
    return control.value;
}

struct Wanted {
    Control control;
    std::int32_t value = 0;
};

std::vector<Wanted> make_neutral(VideoNode& node, SettledControls& settled) {
    std::vector<Wanted> wanted;
    for (const Control& control : neutral_controls) {
        const auto range = find(node, control);
        if (!range) {
            settled.absent.emplace_back(control.name);
        } else if ((range->flags & V4L2_CTRL_FLAG_INACTIVE) != 0) {
            settled.inactive.emplace_back(control.name);
        } else {
            wanted.push_back({control, target(control, *range)});
            write(node, control, *range, wanted.back().value);
        }
    }
    return wanted;
}

void set_exposure(VideoNode& node, Seconds exposure, SettledControls& settled) {
    const auto range = find(node, exposure_control);
    settled.tells_exposure = range.has_value();
    if (!range) {
        settled.absent.emplace_back(exposure_control.name);
        return;
    }
    settled.exposure_range = {range->minimum * exposure_unit, range->maximum * exposure_unit};
    const double steps = (exposure / exposure_unit - range->minimum) / std::max(range->step, 1);
    const double value = range->minimum + std::round(steps) * std::max(range->step, 1);
    if (value < range->minimum || value > range->maximum)
        throw InputError(
            fmt::format("exposure_ms is {}; {} allows {} to {}", exposure.count() * 1000, node.path(),
                        range->minimum * exposure_unit.count() * 1000, range->maximum * exposure_unit.count() * 1000),
            "correct exposure_ms of [camera]");
    write(node, exposure_control, *range, static_cast<std::int32_t>(value));
}

void set_gain(VideoNode& node, double gain, SettledControls& settled) {
    const auto range = find(node, gain_control);
    settled.tells_gain = range.has_value();
    if (!range) settled.absent.emplace_back(gain_control.name);
    const bool counts = range && range->minimum > 0;
    if (!counts && gain != 1.0)
        throw InputError(fmt::format("gain is {}, but {} has no gain whose unit is known", gain, node.path()),
                         "set gain = 1 in [camera] and expose for longer");
    if (!range) return;
    settled.lowest_gain = range->minimum;
    const double value = counts ? std::round(gain * range->minimum) : range->minimum;
    if (value < range->minimum || value > range->maximum)
        throw InputError(fmt::format("gain is {}; {} allows 1 to {}", gain, node.path(),
                                     static_cast<double>(range->maximum) / range->minimum),
                         "correct gain of [camera]");
    write(node, gain_control, *range, static_cast<std::int32_t>(value));
    const std::int32_t found = read(node, gain_control);
    if (found != static_cast<std::int32_t>(value))
        throw_does_not_hold(node, gain_control, fmt::format("was set to {} and reads {}", value, found));
}

}  // namespace

SettledControls settle_controls(VideoNode& node, const CameraConfig& config) {
    SettledControls settled;
    settled.in_effect = {config.exposure, config.gain};
    const std::vector<Wanted> wanted = make_neutral(node, settled);
    set_exposure(node, config.exposure, settled);
    set_gain(node, config.gain, settled);
    // Last, for one control may move another.
    for (const auto& [control, value] : wanted) {
        const std::int32_t found = read(node, control);
        if (found != value) throw_does_not_hold(node, control, fmt::format("was set to {} and reads {}", value, found));
    }
    settled.in_effect = read_controls(node, settled);
    const double ratio = settled.in_effect.exposure / config.exposure;
    if (settled.tells_exposure && std::abs(ratio - 1.0) > exposure_tolerance)
        throw_does_not_hold(node, exposure_control,
                            fmt::format("was set to {} ms and reads {} ms", config.exposure.count() * 1000,
                                        settled.in_effect.exposure.count() * 1000));
    return settled;
}

FrameControls read_controls(VideoNode& node, const SettledControls& settled) {
    FrameControls controls = settled.in_effect;
    if (settled.tells_exposure) controls.exposure = read(node, exposure_control) * exposure_unit;
    if (settled.tells_gain) {
        const double value = read(node, gain_control);
        const double lowest = settled.lowest_gain;
        controls.gain = lowest > 0 ? value / lowest : 1 + value - lowest;  // the latter tells but that it moved
    }
    return controls;
}

}  // namespace darkbox
