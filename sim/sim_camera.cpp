#include "sim/sim_camera.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <stdexcept>
#include <utility>

#include "acquisition/device/device_error.h"
#include "sim/optics.h"

namespace darkbox::sim {
namespace {

constexpr double warming_half_s = 30;  ///< after which half of what a cold sensor is off by is gone

constexpr FrameControls power_on_controls{Seconds{0.02}, 1.0};

PixelFormat format_of(const SimCameraOptions& options) {
    const bool wide = options.sensor.bit_depth > 8;
    switch (options.colour) {
        case SensorColour::grey:
            return wide ? PixelFormat::grey16 : PixelFormat::grey8;
        case SensorColour::rggb:
            return wide ? PixelFormat::rggb16 : PixelFormat::rggb8;
        case SensorColour::rgb:
            break;
    }
    return wide ? PixelFormat::rgb16 : PixelFormat::rgb8;
}

static_assert(std::endian::native == std::endian::little, "Frame samples are little-endian words");

std::vector<std::byte> as_bytes(const std::vector<std::uint16_t>& samples, PixelFormat format) {
    const auto words = std::as_bytes(std::span(samples));
    if (bytes_per_sample(format) == 2) return {words.begin(), words.end()};
    std::vector<std::byte> bytes(samples.size());
    std::transform(samples.begin(), samples.end(), bytes.begin(), [](std::uint16_t s) { return std::byte(s & 0xFFU); });
    return bytes;
}

/// What a broken transfer leaves: the lower half is the upper half's bytes out of place.
void damage(std::vector<std::byte>& bytes) {
    const auto half = static_cast<std::ptrdiff_t>(bytes.size() / 2);
    std::rotate_copy(bytes.begin(), bytes.begin() + half / 3, bytes.begin() + half, bytes.begin() + half);
}

}  // namespace

SimCamera::SimCamera(const Scene& scene, std::shared_ptr<LampPictures> pictures, LampWitness& lamps, SimClock& clock,
                     SimCameraOptions options)
    : scene_(scene),
      pictures_(std::move(pictures)),
      lamps_(lamps),
      clock_(clock),
      options_(std::move(options)),
      controls_(power_on_controls),
      controls_before_(power_on_controls),
      waits_hung_(options_.faults.faults.size(), 0) {
    if (options_.quick_noise) quick_.emplace(options_.sensor.seed);
    lamps_.set_strobe_source([this] { strobe_until_now(); });
}

SimCamera::~SimCamera() { lamps_.set_strobe_source({}); }

CameraInfo SimCamera::configure(const CameraConfig& config) {
    if (state_ == State::streaming) throw std::logic_error("SimCamera::configure while streaming");
    if (!(config.exposure.count() > 0.0) || !(config.gain > 0.0))
        throw DeviceError(
            fmt::format("the simulated camera cannot expose for {} s at gain {}", config.exposure.count(), config.gain),
            "exposure and gain must be positive");
    state_ = State::ready;
    controls_before_ = controls_;
    controls_ = {config.exposure, config.gain};

    CameraInfo info;
    info.model = "darkbox simulated camera";
    info.id = "sim:" + scene_.name;
    info.driver = "sim";
    info.width = scene_.view.width;
    info.height = scene_.view.height;
    info.format = format_of(options_);
    info.bit_depth = options_.sensor.bit_depth;
    info.black_level = options_.sensor.black_level;
    info.frame_period = std::max({options_.shortest_period, controls_.exposure + options_.readout,
                                  controls_before_.exposure + options_.readout});
    info.queue_depth = options_.queue_depth;
    info.latency_frames = options_.latency_frames;
    info.readout = Seconds(0);
    info.controls = controls_;
    info.exposure_range = {options_.shortest_exposure, options_.longest_exposure};
    period_ = to_nanoseconds(info.frame_period);
    return info;
}

void SimCamera::start() {
    if (state_ != State::ready) throw std::logic_error("SimCamera::start in a state other than ready");
    fail_while_unplugged();
    state_ = State::streaming;
    stream_start_ = clock_.now();
    if (!first_start_) first_start_ = stream_start_;
    first_sequence_ = next_strobe_ = next_sequence_;
    queue_.clear();
    // Now, while nobody waits with a lamp lit: in real time the rendering takes longer than a lamp may be on.
    if (!scene_.lamps.empty()) pictures_->of(LampId{0});
    lamps_.strobe_runs(stream_start_, period_, to_nanoseconds(controls_.exposure));
}

void SimCamera::stop() {
    if (state_ != State::streaming) return;
    state_ = State::ready;
    queue_.clear();
    lamps_.strobe_runs(clock_.now(), {}, {});
    if (next_sequence_ >= first_sequence_ + static_cast<std::uint64_t>(options_.latency_frames))
        controls_before_ = controls_;
}

SimCamera::Exposure SimCamera::exposure(std::uint64_t sequence) const {
    const std::uint64_t place = sequence - first_sequence_;
    const bool settled = place >= static_cast<std::uint64_t>(options_.latency_frames);
    Exposure e{sequence, settled ? controls_ : controls_before_, {}};
    e.interval.begin = stream_start_ + period_ * static_cast<Nanoseconds::rep>(place);
    e.interval.end = e.interval.begin + to_nanoseconds(e.controls.exposure);
    return e;
}

void SimCamera::strobe_until_now() {
    if (state_ != State::streaming) return;
    for (; exposure(next_strobe_).interval.end <= clock_.now(); ++next_strobe_)
        lamps_.strobe(exposure(next_strobe_).interval.end);
}

void SimCamera::fill_queue() {
    strobe_until_now();
    for (;; ++next_sequence_) {
        const Exposure e = exposure(next_sequence_);
        if (finished(e) > clock_.now()) return;
        const bool lost = options_.faults.hits(FaultKind::drop, e.sequence);
        if (!lost && queue_.size() < static_cast<std::size_t>(options_.queue_depth)) queue_.push_back(e);
    }
}

bool SimCamera::hangs() {
    const auto& faults = options_.faults.faults;
    const std::uint64_t sequence = queue_.empty() ? next_sequence_ : queue_.front().sequence;
    for (std::size_t i = 0; i < faults.size(); ++i)
        if (faults[i].kind == FaultKind::hang && sequence >= faults[i].at && waits_hung_[i] < faults[i].count) {
            ++waits_hung_[i];
            return true;
        }
    return false;
}

void SimCamera::wait_for_frame(TimePoint deadline) {
    fill_queue();
    const bool hung = hangs();
    while (hung || queue_.empty()) {
        const TimePoint moment = hung ? TimePoint::max() : finished(exposure(next_sequence_));
        if (moment > deadline) {
            clock_.sleep_until(deadline);
            throw DeadlineError("the simulated camera gave no frame before the deadline",
                                "allow at least one frame period, or restart the camera");
        }
        clock_.sleep_until(moment);
        fill_queue();
    }
}

/// What the driver's counter says of it.
std::uint64_t SimCamera::counted(std::uint64_t sequence) const {
    for (const Fault& fault : options_.faults.faults)
        if (fault.kind == FaultKind::sequence_wrap && fault.at <= sequence) return sequence - fault.at;
    return sequence;
}

/// What a knock or a lens out of focus makes of it.
RgbImage SimCamera::seen(RgbImage light, std::uint64_t sequence) const {
    const FaultPlan& faults = options_.faults;
    const auto object_knock = faults.amount(FaultKind::object_knock, sequence);
    if (object_knock) {
        const RgbImage still = std::exchange(light, shifted(light, *object_knock));
        for (const MirrorBall& ball : scene_.balls) copy_disc(still, ball_circle(scene_.view, ball.sphere), light);
    }
    if (const auto knock = faults.amount(FaultKind::camera_knock, sequence)) light = shifted(light, *knock);
    if (const auto sigma_px = faults.amount(FaultKind::defocus, sequence)) light = blurred(light, *sigma_px);
    return light;
}

/// Gone from the plan's frame on, until it was started anew `count` times, the last time with success.
void SimCamera::fail_while_unplugged() {
    for (std::size_t i = 0; i < options_.faults.faults.size(); ++i) {
        const Fault& fault = options_.faults.faults[i];
        std::uint64_t& calls = waits_hung_[i];
        if (fault.kind != FaultKind::unplug || next_sequence_ < fault.at || calls > fault.count) continue;
        const bool starts = state_ == State::ready;
        if (starts == (calls > 0)) ++calls;  // the first call that fails waits for a frame; then starts count
        if (calls == 0 || calls > fault.count) continue;
        throw DeviceError("the simulated camera was unplugged", "plug it in again");
    }
}

Frame SimCamera::next_frame(TimePoint deadline) {
    if (state_ != State::streaming) throw std::logic_error("SimCamera::next_frame while not streaming");
    fail_while_unplugged();
    wait_for_frame(deadline);
    Exposure oldest = queue_.front();
    queue_.pop_front();
    if (options_.faults.hits(FaultKind::stale_queue, oldest.sequence))
        oldest = earlier(oldest, static_cast<std::uint64_t>(options_.queue_depth) + 1);
    return deliver(oldest);
}

SimCamera::Exposure SimCamera::earlier(const Exposure& e, std::uint64_t frames) const {
    return exposure(e.sequence - std::min(frames, e.sequence - first_sequence_));
}

Frame SimCamera::deliver(const Exposure& e) {
    const FaultPlan& faults = options_.faults;
    const Exposure picture = faults.hits(FaultKind::repeat, e.sequence) ? earlier(e, 1) : e;
    const bool black = faults.hits(FaultKind::black_frame, e.sequence);
    const auto burning = black ? std::vector<LampShare>{} : lamps_.burning_during(picture.interval);
    exposures_.push_back({e.sequence, e.interval.begin, burning});

    Sensor sensor = options_.sensor;
    sensor.nonlinearity = faults.amount(FaultKind::nonlinear, picture.sequence).value_or(0.0);
    if (const auto cold = faults.amount(FaultKind::warming, picture.sequence))
        sensor.black_level += *cold * sensor.full_scale() *
                              std::exp2(-to_seconds(picture.interval.begin - *first_start_) / warming_half_s);
    Frame frame;
    frame.width = scene_.view.width;
    frame.height = scene_.view.height;
    frame.format = format_of(options_);
    frame.bit_depth = sensor.bit_depth;
    frame.black_level = options_.sensor.black_level;
    frame.pixels = as_bytes(samples_of(picture, burning, sensor), frame.format);
    frame.sequence = counted(e.sequence);
    frame.timestamp = e.interval.begin;
    frame.exposure = e.interval;
    frame.controls = e.controls;
    if (faults.hits(FaultKind::error_flag, e.sequence)) {
        frame.status = FrameStatus::error;
        damage(frame.pixels);
    }
    return frame;
}

std::vector<LightShare> SimCamera::lights_of(const std::vector<LampShare>& burning) {
    std::vector<LightShare> lights;
    for (const LampShare& b : burning) lights.push_back({static_cast<float>(b.share), pictures_->of(b.lamp)});
    if (options_.room_light > 0)
        for (std::uint32_t lamp = 0; lamp < scene_.lamps.size(); ++lamp)
            lights.push_back({static_cast<float>(options_.room_light), pictures_->of(LampId{lamp})});
    return lights;
}

std::vector<float> SimCamera::sum_of(const std::vector<LightShare>& lights) const {
    const auto pixels = static_cast<std::size_t>(scene_.view.width) * static_cast<std::size_t>(scene_.view.height);
    std::vector<float> sum(pixels * static_cast<std::size_t>(samples_per_pixel(pictures_->colour())), 0.0F);
    for (const LightShare& light : lights)
        for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += light.share * light.radiance[i];
    return sum;
}

std::vector<std::uint16_t> SimCamera::samples_of(const Exposure& picture, const std::vector<LampShare>& burning,
                                                 const Sensor& sensor) {
    const ExposureSetting setting{picture.controls.exposure.count(), picture.controls.gain, picture.sequence};
    const auto pixels = static_cast<std::size_t>(scene_.view.width) * static_cast<std::size_t>(scene_.view.height);
    std::vector<LightShare> lights = lights_of(burning);
    std::vector<float> light;
    if (changes_what_is_seen(options_.faults)) {
        RgbImage sum(scene_.view.width, scene_.view.height);
        sum.samples = sum_of(lights);
        light = sampled(seen(std::move(sum), picture.sequence), options_.colour);
        lights = {{1.0F, light}};
    } else if (!quick_) {
        light = sum_of(lights);
    }
    if (!quick_) return expose(sensor, std::span<const float>(light), setting);
    std::vector<std::uint16_t> samples(pixels * static_cast<std::size_t>(samples_per_pixel(options_.colour)));
    quick_->expose(sensor, lights, setting, samples);
    return samples;
}

}  // namespace darkbox::sim
