#include "acquisition/camera/video_mode.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <linux/videodev2.h>

#include <algorithm>
#include <cerrno>
#include <cmath>

#include "acquisition/frame/error.h"

namespace darkbox {
namespace {

constexpr std::uint32_t capture = V4L2_BUF_TYPE_VIDEO_CAPTURE;
constexpr VideoRequest set_format{VIDIOC_S_FMT, "VIDIOC_S_FMT"};
constexpr VideoRequest get_format{VIDIOC_G_FMT, "VIDIOC_G_FMT"};
constexpr VideoRequest list_formats{VIDIOC_ENUM_FMT, "VIDIOC_ENUM_FMT"};
constexpr VideoRequest list_sizes{VIDIOC_ENUM_FRAMESIZES, "VIDIOC_ENUM_FRAMESIZES"};
constexpr VideoRequest list_intervals{VIDIOC_ENUM_FRAMEINTERVALS, "VIDIOC_ENUM_FRAMEINTERVALS"};
constexpr VideoRequest get_selection{VIDIOC_G_SELECTION, "VIDIOC_G_SELECTION"};
constexpr VideoRequest set_selection{VIDIOC_S_SELECTION, "VIDIOC_S_SELECTION"};
constexpr VideoRequest set_rate{VIDIOC_S_PARM, "VIDIOC_S_PARM"};
constexpr VideoRequest get_rate{VIDIOC_G_PARM, "VIDIOC_G_PARM"};

constexpr double rate_tolerance = 0.01;
constexpr std::uint32_t most_entries = 1000;  ///< of a list; a driver's list must end

struct Size {
    std::uint32_t width = 0;
    std::uint32_t height = 0;
};

void require_between(const char* field, int value, int least, int most) {
    if (value < least || value > most)
        throw InputError(fmt::format("{} is {}; allowed: {} to {}", field, value, least, most), "correct [camera]");
}

std::vector<std::uint32_t> offered_formats(VideoNode& node) {
    std::vector<std::uint32_t> codes;
    v4l2_fmtdesc entry{};
    for (entry.type = capture; entry.index < most_entries && node.ask(list_formats, entry) == 0; ++entry.index)
        codes.push_back(entry.pixelformat);
    return codes;
}

SensorFormat choose_format(VideoNode& node, const V4l2Options& options) {
    const std::vector<std::uint32_t> offered = offered_formats(node);
    const auto is_offered = [&](std::uint32_t code) {
        return std::find(offered.begin(), offered.end(), code) != offered.end();
    };
    std::vector<std::string> usable, others;
    for (const std::uint32_t code : offered) (sensor_format(code) ? usable : others).push_back(fourcc_name(code));
    const std::string has = fmt::format("the camera has {}{}", usable.empty() ? "none that darkbox can keep" : "",
                                        fmt::join(usable, ", ")) +
                            (others.empty() ? "" : fmt::format("; not usable: {}", fmt::join(others, ", ")));
    if (options.format.empty()) {
        for (const SensorFormat& format : sensor_formats())
            if (format.packing != Packing::jpeg && is_offered(format.fourcc)) return format;
        const bool compressed = is_offered(V4L2_PIX_FMT_MJPEG);
        throw InputError(
            fmt::format("{} has no picture format to measure with", node.path()),
            compressed ? has + "; format = \"MJPG\" of [camera] takes its JPEGs, which are neither linear nor exact"
                       : has);
    }
    const auto code = fourcc_from_name(options.format);
    const auto format = code ? sensor_format(*code) : std::nullopt;
    if (!format || !is_offered(*code))
        throw InputError(fmt::format("format is \"{}\", which {} of {}", options.format,
                                     format ? "is none" : "is no format that darkbox can keep", node.path()),
                         has);
    return *format;
}

/// Those of a stepwise list are its ends. Empty where the driver does not tell.
std::vector<Size> offered_sizes(VideoNode& node, std::uint32_t fourcc) {
    std::vector<Size> sizes;
    v4l2_frmsizeenum entry{};
    entry.pixel_format = fourcc;
    for (; entry.index < most_entries && node.ask(list_sizes, entry) == 0; ++entry.index) {
        if (entry.type != V4L2_FRMSIZE_TYPE_DISCRETE) return {{entry.stepwise.max_width, entry.stepwise.max_height}};
        sizes.push_back({entry.discrete.width, entry.discrete.height});
    }
    return sizes;
}

Size choose_size(VideoNode& node, const V4l2Options& options, const SensorFormat& format) {
    if (options.width > 0)
        return {static_cast<std::uint32_t>(options.width), static_cast<std::uint32_t>(options.height)};
    const std::vector<Size> sizes = offered_sizes(node, format.fourcc);
    if (!sizes.empty())
        return *std::max_element(sizes.begin(), sizes.end(), [](const Size& a, const Size& b) {
            return std::uint64_t{a.width} * a.height < std::uint64_t{b.width} * b.height;
        });
    v4l2_format current{};
    current.type = capture;
    node.call(get_format, current);
    return {current.fmt.pix.width, current.fmt.pix.height};
}

SensorLayout agree_on_layout(VideoNode& node, const V4l2Options& options) {
    const SensorFormat format = choose_format(node, options);
    const Size size = choose_size(node, options, format);
    v4l2_format asked{};
    asked.type = capture;
    asked.fmt.pix.pixelformat = format.fourcc;
    asked.fmt.pix.width = size.width;
    asked.fmt.pix.height = size.height;
    asked.fmt.pix.field = V4L2_FIELD_NONE;
    node.call(set_format, asked);
    const v4l2_pix_format& agreed = asked.fmt.pix;
    if (agreed.pixelformat != format.fourcc || agreed.width != size.width || agreed.height != size.height)
        throw InputError(
            fmt::format("{} was asked for {} x {} {} and delivers {} x {} {}", node.path(), size.width, size.height,
                        fourcc_name(format.fourcc), agreed.width, agreed.height, fourcc_name(agreed.pixelformat)),
            "set format, width and height of [camera] to what it delivers");
    if (agreed.field != V4L2_FIELD_NONE)
        throw DeviceError(fmt::format("{} delivers interlaced pictures", node.path()),
                          "use a mode of the camera that is not interlaced");
    SensorLayout layout{format, static_cast<int>(size.width), static_cast<int>(size.height), agreed.bytesperline};
    if (layout.bytes_per_line == 0) layout.bytes_per_line = row_bytes(format, layout.width);
    if (layout.bytes_per_line < row_bytes(format, layout.width) || agreed.sizeimage < payload_bytes(layout))
        throw DeviceError(
            fmt::format("{} describes {} bytes a row and {} a picture for {} x {} {}", node.path(), agreed.bytesperline,
                        agreed.sizeimage, size.width, size.height, fourcc_name(format.fourcc)),
            "the camera's driver is at fault: try another format of [camera]");
    return layout;
}

/// ENODATA: other inputs of the same device can crop.
bool means_cannot(int error) { return error == EINVAL || error == ENOTTY || error == ENODATA; }

void agree_on_crop(VideoNode& node, const V4l2Options& options) {
    v4l2_selection selection{};
    selection.type = capture;
    if (options.crop) {
        const auto& [left, top, width, height] = *options.crop;
        selection.r = {left, top, static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(height)};
    } else {
        selection.target = V4L2_SEL_TGT_CROP_DEFAULT;
        if (node.ask(get_selection, selection) != 0) return;  // cameras that cannot crop
    }
    selection.target = V4L2_SEL_TGT_CROP;
    const v4l2_rect asked = selection.r;
    const int error = node.ask(set_selection, selection);
    if (error == 0 && selection.r.left == asked.left && selection.r.top == asked.top &&
        selection.r.width == asked.width && selection.r.height == asked.height)
        return;
    if (!options.crop && means_cannot(error)) return;
    if (error != 0 && !means_cannot(error)) node.fail(set_selection.name, error);
    throw InputError(fmt::format("crop is [{}, {}, {}, {}], which {} cannot do{}", asked.left, asked.top, asked.width,
                                 asked.height, node.path(),
                                 error == 0 ? fmt::format("; nearest: [{}, {}, {}, {}]", selection.r.left,
                                                          selection.r.top, selection.r.width, selection.r.height)
                                            : ""),
                     "correct crop of [camera], or leave it out");
}

double seconds(const v4l2_fract& period) {
    return period.denominator == 0 ? 0.0 : static_cast<double>(period.numerator) / period.denominator;
}

/// Empty where the driver does not tell; those of a stepwise list are its ends.
std::vector<v4l2_fract> offered_intervals(VideoNode& node, const SensorLayout& layout) {
    std::vector<v4l2_fract> intervals;
    v4l2_frmivalenum entry{};
    entry.pixel_format = layout.format.fourcc;
    entry.width = static_cast<std::uint32_t>(layout.width);
    entry.height = static_cast<std::uint32_t>(layout.height);
    for (; entry.index < most_entries && node.ask(list_intervals, entry) == 0; ++entry.index) {
        if (entry.type != V4L2_FRMIVAL_TYPE_DISCRETE) return {entry.stepwise.min, entry.stepwise.max};
        intervals.push_back(entry.discrete);
    }
    return intervals;
}

/// The shortest interval that holds the exposure, else the longest: a camera's frames come no faster than it exposes.
v4l2_fract choose_interval(const std::vector<v4l2_fract>& offered, const V4l2Options& options, Seconds exposure) {
    if (options.frame_rate || offered.empty()) {
        const double rate = options.frame_rate.value_or(1.0 / exposure.count());
        return {1000, static_cast<std::uint32_t>(std::max(1.0, std::round(1000 * rate)))};
    }
    v4l2_fract best = offered.front();
    for (const v4l2_fract& each : offered) {
        const bool holds = seconds(each) >= exposure.count();
        const bool best_holds = seconds(best) >= exposure.count();
        if (holds ? !best_holds || seconds(each) < seconds(best) : !best_holds && seconds(each) > seconds(best))
            best = each;
    }
    return best;
}

Seconds agree_on_interval(VideoNode& node, const V4l2Options& options, const SensorLayout& layout, Seconds exposure) {
    const std::vector<v4l2_fract> offered = offered_intervals(node, layout);
    v4l2_streamparm parameters{};
    parameters.type = capture;
    if (options.frame_rate || !offered.empty()) {
        parameters.parm.capture.timeperframe = choose_interval(offered, options, exposure);
        const int error = node.ask(set_rate, parameters);
        if (error != 0 && error != EINVAL && error != ENOTTY) node.fail(set_rate.name, error);
    }
    const bool told = node.ask(get_rate, parameters) == 0 && seconds(parameters.parm.capture.timeperframe) > 0;
    const double period = told ? seconds(parameters.parm.capture.timeperframe) : 0.0;
    if (options.frame_rate && std::abs(period * *options.frame_rate - 1.0) > rate_tolerance)
        throw InputError(fmt::format("frame_rate is {}, but {} takes {:.3f} frames a second", *options.frame_rate,
                                     node.path(), period > 0 ? 1.0 / period : 0.0),
                         "set frame_rate of [camera] to what it can do, or leave it out");
    constexpr double slowest = 1.0;  // where the driver does not tell, nothing may be promised
    return std::max(Seconds(period > 0 ? period : slowest), exposure);
}

}  // namespace

void V4l2Options::validate() const {
    if (device.empty()) throw InputError("device is empty", "name the camera: ls /dev/v4l/by-id");
    require_between("width", width, 0, 65'535);
    require_between("height", height, 0, 65'535);
    require_between("buffers", buffers, 2, 32);
    if ((width == 0) != (height == 0))
        throw InputError(fmt::format("width is {} and height is {}; give both or neither", width, height),
                         "correct [camera]");
    if (frame_rate && !(*frame_rate >= 0.01 && *frame_rate <= 10'000))
        throw InputError(fmt::format("frame_rate is {}; allowed: 0.01 to 10000", *frame_rate), "correct [camera]");
    if (crop) {
        for (const int edge : *crop) require_between("crop", edge, 0, 65'535);
        require_between("crop's width", (*crop)[2], 1, 65'535);
        require_between("crop's height", (*crop)[3], 1, 65'535);
    }
}

VideoMode negotiate(VideoNode& node, const V4l2Options& options, Seconds exposure) {
    agree_on_crop(node, options);
    const SensorLayout layout = agree_on_layout(node, options);
    return {layout, agree_on_interval(node, options, layout, exposure)};
}

}  // namespace darkbox
