#include "acquisition/camera/v4l2_camera.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "acquisition/frame/error.h"

namespace darkbox {
namespace {

constexpr VideoRequest query_capability{VIDIOC_QUERYCAP, "VIDIOC_QUERYCAP"};
constexpr Nanoseconds look_for_it_every = std::chrono::milliseconds(100);
constexpr std::uint64_t sequences = std::uint64_t{1} << 32;
constexpr const char* stable_names = "/dev/v4l/by-id/";

template <std::size_t size>
std::string text(const __u8 (&field)[size]) {
    const auto* end = std::find(std::begin(field), std::end(field), 0);
    return {std::begin(field), end};
}

v4l2_capability capability_of(VideoNode& node) {
    v4l2_capability capability{};
    node.call(query_capability, capability);
    const std::uint32_t can =
        (capability.capabilities & V4L2_CAP_DEVICE_CAPS) != 0 ? capability.device_caps : capability.capabilities;
    if ((can & V4L2_CAP_VIDEO_CAPTURE) == 0)
        throw InputError(fmt::format("{} ({}) is no single-planar capture device", node.path(), text(capability.card)),
                         "name another node of the camera in device of [camera], usually ...-video-index0");
    if ((can & V4L2_CAP_STREAMING) == 0)
        throw InputError(fmt::format("{} ({}) cannot stream", node.path(), text(capability.card)),
                         "use a camera whose driver can map its buffers");
    return capability;
}

TimePoint stamp_of(const v4l2_buffer& buffer) {
    return TimePoint(std::chrono::seconds(buffer.timestamp.tv_sec) +
                     std::chrono::microseconds(buffer.timestamp.tv_usec));
}

/// A JPEG that cannot be read lost bytes on its way.
void decode(std::span<const std::byte> payload, const SensorLayout& layout, Frame& frame) {
    try {
        frame.pixels = unpack(layout, payload);
        frame.jpeg.assign(payload.begin(), payload.end());
    } catch (const InputError&) {
        frame.status = FrameStatus::truncated;
    }
}

bool same_picture(const CameraInfo& a, const CameraInfo& b) {
    return a.model == b.model && a.controls.exposure == b.controls.exposure && a.controls.gain == b.controls.gain;
}

}  // namespace

std::vector<std::string> camera_ids(const std::filesystem::path& folder) {
    std::vector<std::string> ids;
    std::error_code none;
    for (const auto& entry : std::filesystem::directory_iterator(folder, none))
        ids.push_back(entry.path().filename().string());
    std::sort(ids.begin(), ids.end());
    return ids;
}

V4l2Camera::V4l2Camera(VideoDevice& device, Clock& clock, V4l2Options options)
    : device_(device), clock_(clock), options_(std::move(options)) {
    options_.validate();
    if (options_.device.find('/') == std::string::npos) options_.device = stable_names + options_.device;
}

V4l2Camera::~V4l2Camera() { release(); }

void V4l2Camera::release() {
    stream_.reset();
    node_.reset();
}

CameraInfo V4l2Camera::configure(const CameraConfig& config) {
    if (state_ == State::streaming) throw std::logic_error("V4l2Camera::configure while it streams");
    state_ = State::closed;
    config_ = config;
    release();
    try {
        setup_ = set_up();
    } catch (const CameraGone& error) {
        const std::vector<std::string> ids = camera_ids();
        throw CameraGone(error.what(), ids.empty()
                                           ? error.hint()
                                           : fmt::format("the cameras that are there: {}", fmt::join(ids, ", ")));
    }
    state_ = State::ready;
    return setup_->info;
}

/// Controls come first and are looked at last: a change of format may reset them.
V4l2Camera::Setup V4l2Camera::set_up() {
    node_ = std::make_unique<VideoNode>(device_, options_.device);
    const v4l2_capability capability = capability_of(*node_);
    is_uvc_ = text(capability.driver) == "uvcvideo";
    Setup setup;
    setup.mode = negotiate(*node_, options_, config_.exposure);
    setup.controls = settle_controls(*node_, config_);
    // Without such a control the camera exposes for no longer than a frame takes: that is what is known.
    if (!setup.controls.tells_exposure) setup.controls.in_effect.exposure = setup.mode.frame_period;
    setup.info = describe(capability, setup);
    return setup;
}

CameraInfo V4l2Camera::describe(const v4l2_capability& capability, const Setup& setup) const {
    const auto& [format, width, height, bytes_per_line] = setup.mode.layout;
    CameraInfo info;
    info.model = text(capability.card);
    info.id = options_.device;
    info.driver = text(capability.driver);
    info.width = width;
    info.height = height;
    info.format = format.format;
    info.bit_depth = format.bit_depth;
    info.black_level = format.black_level;
    info.frame_period = setup.mode.frame_period;
    info.queue_depth = options_.buffers;
    info.controls = setup.controls.in_effect;
    info.exposure_range = setup.controls.exposure_range;
    info.notes.push_back(fmt::format("camera: {} by {} at {}, {} of {} x {}, {:.3f} frames a second", info.model,
                                     text(capability.driver), text(capability.bus_info), fourcc_name(format.fourcc),
                                     width, height, 1.0 / info.frame_period.count()));
    if (format.format == PixelFormat::ycc8 || format.format == PixelFormat::rgb8)
        info.notes.emplace_back(
            "camera: its samples were processed for display and may not be proportional to the light");
    if (!setup.controls.absent.empty())
        info.notes.push_back(fmt::format("camera: has no {}", fmt::join(setup.controls.absent, ", ")));
    if (!setup.controls.inactive.empty())
        info.notes.push_back(
            fmt::format("camera: says of these that they do nothing: {}", fmt::join(setup.controls.inactive, ", ")));
    return info;
}

void V4l2Camera::start() {
    if (state_ != State::ready) throw std::logic_error("V4l2Camera::start in a state other than ready");
    state_ = State::streaming;
    if (!node_) return;
    try {
        open_stream();
    } catch (const CameraGone&) {
        release();
    } catch (...) {
        state_ = State::ready;
        throw;
    }
}

void V4l2Camera::open_stream() {
    last_sequence_.reset();
    stream_ = std::make_unique<VideoStream>(*node_, options_.buffers);
}

void V4l2Camera::stop() {
    stream_.reset();
    if (state_ == State::streaming) state_ = State::ready;
}

/// Until it is there by its name and streams. udev may take its time with names and permissions.
void V4l2Camera::await_return(TimePoint deadline) {
    while (!stream_) {
        std::string why;
        try {
            Setup returned = set_up();
            require_same(returned);
            setup_ = std::move(returned);
            open_stream();
            return;
        } catch (const InputError&) {
            release();
            throw;
        } catch (const DeviceError& error) {
            release();
            why = error.what();
        }
        if (clock_.now() >= deadline)
            throw DeadlineError(fmt::format("waiting for the camera: {}", why),
                                "plug the camera in again, into the same port if its name has no serial number");
        clock_.sleep_until(std::min(deadline, clock_.now() + look_for_it_every));
    }
}

void V4l2Camera::require_same(const Setup& returned) const {
    if (returned.mode == setup_->mode && same_picture(returned.info, setup_->info)) return;
    throw InputError(fmt::format("the camera came back as {} of {} x {}, and was {} of {} x {}", returned.info.model,
                                 returned.info.width, returned.info.height, setup_->info.model, setup_->info.width,
                                 setup_->info.height),
                     "plug in the camera that the session was begun with, or capture a new session");
}

Frame V4l2Camera::next_frame(TimePoint deadline) {
    if (state_ != State::streaming) throw std::logic_error("V4l2Camera::next_frame in a state other than streaming");
    if (!stream_) await_return(deadline);
    try {
        while (true) {
            const Nanoseconds patience = std::max(deadline - clock_.now(), Nanoseconds(0));
            if (const auto buffer = stream_->take(patience)) {
                Frame frame = frame_of(*buffer);
                stream_->give_back(*buffer);
                return frame;
            }
            if (clock_.now() >= deadline)
                throw DeadlineError(fmt::format("{} delivered no frame in time", options_.device),
                                    "check the camera's cable; raise frame_deadline_s of [capture] for slow cameras");
        }
    } catch (const CameraGone&) {
        release();
        throw;
    }
}

Frame V4l2Camera::frame_of(const v4l2_buffer& buffer) {
    const VideoMode& mode = setup_->mode;
    Frame frame;
    frame.width = mode.layout.width;
    frame.height = mode.layout.height;
    frame.format = mode.layout.format.format;
    frame.bit_depth = mode.layout.format.bit_depth;
    frame.black_level = mode.layout.format.black_level;
    frame.sequence = extend(buffer.sequence);
    frame.timestamp = stamp_of(buffer);
    frame.controls = read_controls(*node_, setup_->controls);
    frame.exposure = exposure_interval(frame.timestamp, stamped_moment(buffer), to_nanoseconds(frame.controls.exposure),
                                       to_nanoseconds(mode.frame_period));
    // Only the readout's upper bound may lie ahead of now; a stamp that does is left for all to see.
    const TimePoint now = clock_.now();
    if (frame.timestamp <= now) frame.exposure.end = std::min(frame.exposure.end, now);

    const auto payload = stream_->payload(buffer);
    if (payload.size() < payload_bytes(mode.layout))
        frame.status = FrameStatus::truncated;
    else if (mode.layout.format.packing == Packing::jpeg)
        decode(payload, mode.layout, frame);
    else
        frame.pixels = unpack(mode.layout, payload);
    if ((buffer.flags & V4L2_BUF_FLAG_ERROR) != 0) frame.status = FrameStatus::error;
    return frame;
}

StampedMoment V4l2Camera::stamped_moment(const v4l2_buffer& buffer) const {
    if ((buffer.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) != V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC)
        throw DeviceError(fmt::format("the timestamps of {} are not of the monotonic clock", options_.device),
                          "use a camera whose driver stamps its frames with CLOCK_MONOTONIC");
    if ((buffer.flags & V4L2_BUF_FLAG_TSTAMP_SRC_MASK) == V4L2_BUF_FLAG_TSTAMP_SRC_EOF)
        return StampedMoment::end_of_frame;
    return is_uvc_ ? StampedMoment::start_of_reception : StampedMoment::start_of_exposure;
}

/// The driver counts in 32 bits. A frame that comes twice, or late, is not taken for a wrap.
std::uint64_t V4l2Camera::extend(std::uint32_t sequence) {
    std::uint64_t extended = sequence;
    if (last_sequence_) {
        extended += *last_sequence_ / sequences * sequences;
        if (extended + sequences / 2 < *last_sequence_) extended += sequences;
    }
    last_sequence_ = std::max(extended, last_sequence_.value_or(0));
    return extended;
}

}  // namespace darkbox
