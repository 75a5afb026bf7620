#include "tests/acquisition/camera/fake_video_device.h"

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "acquisition/camera/sensor_layout.h"

namespace darkbox::test {
namespace {

template <std::size_t size>
void put(__u8 (&field)[size], const std::string& text) {
    std::copy_n(text.begin(), std::min(text.size(), size - 1), field);
}

Nanoseconds period_of(const v4l2_fract& interval) {
    return Nanoseconds(std::int64_t{1'000'000'000} * interval.numerator / interval.denominator);
}

std::uint32_t line_of(std::uint32_t fourcc, std::uint32_t width) {
    const auto format = sensor_format(fourcc);
    return format ? static_cast<std::uint32_t>(row_bytes(*format, static_cast<int>(width))) : width;
}

/// Room enough for a JPEG, too, which has no lines.
std::uint32_t image_bytes(std::uint32_t line, std::uint32_t width, std::uint32_t height) {
    return std::max(line, 2 * width) * height * 2;
}

}  // namespace

int FakeVideoDevice::open(const std::string& asked) {
    if (asked != path || !plugged_) return ENOENT;
    if (open_) broken_rules.emplace_back("opened twice");
    open_ = true;
    stale_ = false;
    ++opened;
    if (live_controls.empty()) plug_in();
    return 0;
}

void FakeVideoDevice::close() {
    if (!open_) return;
    if (std::any_of(buffers_.begin(), buffers_.end(), [](const Buffer& b) { return b.mapped; }))
        broken_rules.emplace_back("closed with buffers mapped");
    buffers_.clear();
    queue_.clear();
    finished_.clear();
    streaming_ = open_ = false;
}

void FakeVideoDevice::plug_in() {
    stale_ = open_ && !plugged_;
    plugged_ = true;
    live_controls = controls;
    live_controls.try_emplace(0);  // no longer empty: the camera has had its power-up
    fourcc_ = modes.front().fourcc;
    width_ = modes.front().width;
    height_ = modes.front().height;
}

int FakeVideoDevice::ioctl(unsigned long request, void* argument) {
    if (!open_) {
        broken_rules.emplace_back("a call on a closed node");
        return EBADF;
    }
    if (gone()) return request == VIDIOC_DQBUF ? EINVAL : ENODEV;  // as uvcvideo does
    if (auto& next = errors[request]; !next.empty()) {
        const int error = next.front();
        next.pop_front();
        if (error != 0) return error;
    }
    return answer(request, argument);
}

int FakeVideoDevice::answer(unsigned long request, void* argument) {
    switch (request) {
        case VIDIOC_QUERYCAP: {
            auto& capability = *static_cast<v4l2_capability*>(argument);
            put(capability.driver, driver);
            put(capability.card, card);
            put(capability.bus_info, "usb-fake-1");
            capability.capabilities = capabilities | V4L2_CAP_DEVICE_CAPS;
            capability.device_caps = capabilities;
            return 0;
        }
        case VIDIOC_ENUM_FMT:
            return enumerate_format(*static_cast<v4l2_fmtdesc*>(argument));
        case VIDIOC_ENUM_FRAMESIZES:
            return enumerate_size(*static_cast<v4l2_frmsizeenum*>(argument));
        case VIDIOC_ENUM_FRAMEINTERVALS:
            return enumerate_interval(*static_cast<v4l2_frmivalenum*>(argument));
        case VIDIOC_S_FMT:
            return set_format(*static_cast<v4l2_format*>(argument));
        case VIDIOC_S_PARM:
            return set_rate(*static_cast<v4l2_streamparm*>(argument));
        case VIDIOC_G_PARM:
            static_cast<v4l2_streamparm*>(argument)->parm.capture.timeperframe = interval_;
            return 0;
        case VIDIOC_G_SELECTION:
        case VIDIOC_S_SELECTION:
            return crops ? select(*static_cast<v4l2_selection*>(argument)) : refuses_crop_with;
        case VIDIOC_QUERYCTRL:
            return query_control(*static_cast<v4l2_queryctrl*>(argument));
        case VIDIOC_S_CTRL:
            return set_control(*static_cast<v4l2_control*>(argument));
        case VIDIOC_G_CTRL: {
            auto& control = *static_cast<v4l2_control*>(argument);
            if (control.id == 0 || !live_controls.contains(control.id)) return EINVAL;
            control.value = live_controls[control.id].value;
            return 0;
        }
        case VIDIOC_REQBUFS:
            return request_buffers(*static_cast<v4l2_requestbuffers*>(argument));
        case VIDIOC_QUERYBUF: {
            auto& buffer = *static_cast<v4l2_buffer*>(argument);
            if (buffer.index >= buffers_.size()) return EINVAL;
            buffer.length = static_cast<std::uint32_t>(buffers_[buffer.index].bytes.size());
            buffer.m.offset = buffer.index * 4096;
            return 0;
        }
        case VIDIOC_QBUF:
            return queue(*static_cast<v4l2_buffer*>(argument));
        case VIDIOC_DQBUF:
            return dequeue(*static_cast<v4l2_buffer*>(argument));
        case VIDIOC_STREAMON:
            if (queue_.empty()) return EINVAL;
            streaming_ = true;
            ++streams;
            sequence_ = 0;
            next_frame_ = time_.now() + period_of(interval_);
            return 0;
        case VIDIOC_STREAMOFF:
            streaming_ = false;
            queue_.clear();
            finished_.clear();
            for (Buffer& buffer : buffers_) buffer.queued = false;
            return 0;
        default:
            return ENOTTY;
    }
}

int FakeVideoDevice::enumerate_format(v4l2_fmtdesc& entry) const {
    std::vector<std::uint32_t> codes;
    for (const FakeMode& mode : modes)
        if (std::find(codes.begin(), codes.end(), mode.fourcc) == codes.end()) codes.push_back(mode.fourcc);
    if (entry.type != V4L2_BUF_TYPE_VIDEO_CAPTURE || entry.index >= codes.size()) return EINVAL;
    entry.pixelformat = codes[entry.index];
    return 0;
}

int FakeVideoDevice::enumerate_size(v4l2_frmsizeenum& entry) const {
    std::uint32_t index = 0;
    for (const FakeMode& mode : modes) {
        if (mode.fourcc != entry.pixel_format || index++ != entry.index) continue;
        entry.type = V4L2_FRMSIZE_TYPE_DISCRETE;
        entry.discrete = {mode.width, mode.height};
        return 0;
    }
    return EINVAL;
}

const FakeMode* FakeVideoDevice::current() const {
    const auto found = std::find_if(modes.begin(), modes.end(), [&](const FakeMode& mode) {
        return mode.fourcc == fourcc_ && mode.width == width_ && mode.height == height_;
    });
    return found == modes.end() ? nullptr : &*found;
}

int FakeVideoDevice::enumerate_interval(v4l2_frmivalenum& entry) const {
    const FakeMode* mode = current();
    if (mode == nullptr || entry.index >= mode->intervals.size()) return EINVAL;
    entry.type = V4L2_FRMIVAL_TYPE_DISCRETE;
    entry.discrete = mode->intervals[entry.index];
    return 0;
}

/// What it does not have becomes its first mode, as drivers do.
int FakeVideoDevice::set_format(v4l2_format& format) {
    if (streaming_ || !buffers_.empty()) return EBUSY;
    v4l2_pix_format& pix = format.fmt.pix;
    fourcc_ = pix.pixelformat;
    width_ = pix.width;
    height_ = pix.height;
    if (current() == nullptr) {
        fourcc_ = modes.front().fourcc;
        width_ = modes.front().width;
        height_ = modes.front().height;
    }
    pix.pixelformat = fourcc_;
    pix.width = width_;
    pix.height = height_;
    pix.field = V4L2_FIELD_NONE;
    pix.bytesperline = line_of(fourcc_, width_) + padding;
    pix.sizeimage = image_bytes(pix.bytesperline, width_, height_);
    return 0;
}

int FakeVideoDevice::set_rate(v4l2_streamparm& parameters) {
    const FakeMode* mode = current();
    if (mode == nullptr || mode->intervals.empty()) return EINVAL;
    const auto distance = [&](const v4l2_fract& each) {
        return std::abs((period_of(each) - period_of(parameters.parm.capture.timeperframe)).count());
    };
    interval_ = *std::min_element(mode->intervals.begin(), mode->intervals.end(),
                                  [&](const auto& a, const auto& b) { return distance(a) < distance(b); });
    parameters.parm.capture.timeperframe = interval_;
    return 0;
}

/// A sensor of 64 x 48 that crops to multiples of 8.
int FakeVideoDevice::select(v4l2_selection& selection) {
    if (selection.target == V4L2_SEL_TGT_CROP_DEFAULT) selection.r = {0, 0, 64, 48};
    selection.r = {selection.r.left / 8 * 8, selection.r.top / 8 * 8, selection.r.width / 8 * 8,
                   selection.r.height / 8 * 8};
    return 0;
}

int FakeVideoDevice::query_control(v4l2_queryctrl& control) const {
    const auto found = live_controls.find(control.id);
    if (control.id == 0 || found == live_controls.end()) return EINVAL;
    const FakeControl& known = found->second;
    control.minimum = known.minimum;
    control.maximum = known.maximum;
    control.step = known.step;
    control.default_value = known.default_value;
    control.flags = known.flags;
    return 0;
}

int FakeVideoDevice::set_control(const v4l2_control& control) {
    const auto found = live_controls.find(control.id);
    if (control.id == 0 || found == live_controls.end()) return EINVAL;
    FakeControl& known = found->second;
    if ((known.flags & V4L2_CTRL_FLAG_READ_ONLY) != 0) return EACCES;
    if (control.value < known.minimum || control.value > known.maximum) return ERANGE;
    if (known.holds) known.value = known.minimum + (control.value - known.minimum) / known.step * known.step;
    return 0;
}

int FakeVideoDevice::request_buffers(v4l2_requestbuffers& request) {
    if (streaming_) return EBUSY;
    if (std::any_of(buffers_.begin(), buffers_.end(), [](const Buffer& b) { return b.mapped; })) return EBUSY;
    const std::size_t size = image_bytes(line_of(fourcc_, width_) + padding, width_, height_);
    buffers_.assign(request.count, Buffer{std::vector<std::byte>(size)});
    return 0;
}

VideoDevice::Mapping FakeVideoDevice::map(std::size_t length, std::int64_t offset) {
    const auto index = static_cast<std::size_t>(offset / 4096);
    if (index >= buffers_.size() || length != buffers_[index].bytes.size()) return {EINVAL, {}};
    buffers_[index].mapped = true;
    return {0, buffers_[index].bytes};
}

void FakeVideoDevice::unmap(std::span<std::byte> bytes) {
    for (Buffer& buffer : buffers_)
        if (buffer.bytes.data() == bytes.data()) buffer.mapped = false;
}

int FakeVideoDevice::queue(const v4l2_buffer& buffer) {
    if (buffer.index >= buffers_.size() || buffers_[buffer.index].queued) return EINVAL;
    buffers_[buffer.index].queued = true;
    queue_.push_back(buffer.index);
    return 0;
}

FakeFrame FakeVideoDevice::make_frame() {
    FakeFrame frame;
    frame.sequence = sequence_++;
    frame.stamp = next_frame_ - period_of(interval_);
    frame.bytes.assign(std::size_t{line_of(fourcc_, width_) + padding} * height_,
                       static_cast<std::byte>(frame.sequence & 255U));
    if (script) script(frame);
    return frame;
}

VideoDevice::Readiness FakeVideoDevice::poll(Nanoseconds patience) {
    if (gone() || !streaming_) return Readiness::failed;
    const TimePoint end = time_.now() + patience;
    while (finished_.empty() && !mute && next_frame_ <= end) {
        time_.sleep_until(next_frame_);
        FakeFrame frame = make_frame();
        next_frame_ += period_of(interval_);
        if (gone()) return Readiness::failed;
        if (!frame.lost) finished_.push_back(std::move(frame));
    }
    if (!finished_.empty()) return Readiness::ready;
    time_.sleep_until(end);
    return Readiness::timed_out;
}

int FakeVideoDevice::dequeue(v4l2_buffer& buffer) {
    if (!streaming_) return EINVAL;
    if (finished_.empty() || queue_.empty()) return EAGAIN;
    const FakeFrame frame = std::move(finished_.front());
    finished_.pop_front();
    if (frame.error != 0) return frame.error;
    buffer.index = queue_.front();
    queue_.pop_front();
    Buffer& filled = buffers_[buffer.index];
    filled.queued = false;
    std::copy_n(frame.bytes.begin(), std::min(frame.bytes.size(), filled.bytes.size()), filled.bytes.begin());
    buffer.bytesused = static_cast<std::uint32_t>(frame.bytes.size());
    buffer.sequence = frame.sequence;
    buffer.flags = frame.flags;
    const auto ns = frame.stamp.time_since_epoch().count();
    buffer.timestamp = {ns / 1'000'000'000, ns % 1'000'000'000 / 1000};
    return 0;
}

}  // namespace darkbox::test
