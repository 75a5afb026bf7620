#include "processing/pipeline/radiance.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <optional>
#include <string>

#include "acquisition/frame/error.h"
#include "acquisition/session/frame_file.h"
#include "processing/formats/picture.h"
#include "processing/formats/srgb.h"
#include "processing/maps/parallel.h"
#include "processing/pipeline/session_files.h"
#include "processing/pipeline/steps.h"

namespace darkbox {
namespace {

constexpr std::size_t frames_at_once = 8;

/// A sensor's samples, and its full scale above the black level.
struct Samples {
    cv::Mat3f raw;  ///< sample units; grey replicated
    double full_scale = 0;
    double black_level = 0;
};

template <class Word>
cv::Mat3f widened(const Frame& frame) {
    const int count = channels(frame.format);
    cv::Mat3f image(frame.height, frame.width);
    std::size_t at = 0;
    for (int y = 0; y < frame.height; ++y)
        for (int x = 0; x < frame.width; ++x) {
            Word words[3] = {};
            std::memcpy(words, frame.pixels.data() + at, static_cast<std::size_t>(count) * sizeof(Word));
            at += static_cast<std::size_t>(count) * sizeof(Word);
            for (int c = 0; c < 3; ++c) image(y, x)[c] = static_cast<float>(words[count == 3 ? c : 0]);
        }
    return image;
}

Samples read_samples(const Session& session, const FrameRecord& record) {
    const Frame frame = read_frame(session.path_of(record), record);
    const bool bytes = bytes_per_sample(frame.format) == 1;
    return {bytes ? widened<std::uint8_t>(frame) : widened<std::uint16_t>(frame), std::exp2(record.bit_depth) - 1.0,
            record.black_level};
}

bool is_captured(const FrameRecord& frame) { return pixel_format_from_name(frame.format).has_value(); }

cv::Mat1b at_full_scale(const cv::Mat3f& samples, double full_scale) {
    cv::Mat1b clipped(samples.size(), uchar{0});
    for (int y = 0; y < samples.rows; ++y)
        for (int x = 0; x < samples.cols; ++x) {
            const cv::Vec3f& p = samples(y, x);
            if (std::max({p[0], p[1], p[2]}) >= full_scale) clipped(y, x) = 255;
        }
    return clipped;
}

Radiance captured_radiance(const Samples& samples, const std::optional<cv::Mat3f>& dark) {
    const double scale = 1.0 / (samples.full_scale - samples.black_level);
    Radiance radiance{{}, at_full_scale(samples.raw, samples.full_scale)};
    if (dark)
        cv::Mat(samples.raw - *dark).convertTo(radiance.image, CV_32F, scale);
    else
        samples.raw.convertTo(radiance.image, CV_32F, scale, -samples.black_level * scale);
    return radiance;
}

Radiance imported_radiance(const Session& session, const FrameRecord& frame) {
    const Picture picture = read_picture(session.path_of(frame));
    Radiance radiance{picture.samples, clipped_samples(picture)};
    if (frame.transfer == TransferCurve::srgb) radiance.image = linear_from_srgb(picture.samples);
    return radiance;
}

/// Exposure and gain: what a lamps-off frame must share with the frame that it is taken from.
bool same_controls(const FrameRecord& a, const FrameRecord& b) {
    const auto near = [](double p, double q) { return std::abs(p - q) <= 1e-6 * std::max(std::abs(p), std::abs(q)); };
    return near(a.exposure_s, b.exposure_s) && near(a.gain, b.gain) && a.width == b.width && a.height == b.height;
}

/// Mean of the lamps-off frames that fit `like`, in sample units.
std::optional<cv::Mat3f> mean_dark(const Session& session, const FrameRecord& like) {
    std::optional<cv::Mat3f> sum;
    int count = 0;
    for (const FrameRecord& dark : frames_of_kind(session, FrameKind::dark)) {
        if (!is_captured(dark) || !same_controls(dark, like)) continue;
        const cv::Mat3f samples = read_samples(session, dark).raw;
        if (sum)
            *sum += samples;
        else
            sum = samples;
        ++count;
    }
    if (sum) *sum /= count;
    return sum;
}

/// The mean lamps-off frame of each different exposure and gain, read once.
class DarkFrames {
public:
    explicit DarkFrames(const Session& session) : session_(session) {}

    const std::optional<cv::Mat3f>& for_frame(const FrameRecord& frame) {
        const auto known =
            std::find_if(means_.begin(), means_.end(), [&](const auto& m) { return same_controls(m.first, frame); });
        if (known != means_.end()) return known->second;
        means_.emplace_back(frame, mean_dark(session_, frame));
        return means_.back().second;
    }

private:
    const Session& session_;
    std::vector<std::pair<FrameRecord, std::optional<cv::Mat3f>>> means_;
};

Radiance read_less_dark(const Session& session, const FrameRecord& frame, const std::optional<cv::Mat3f>& dark) {
    return is_captured(frame) ? captured_radiance(read_samples(session, frame), dark)
                              : imported_radiance(session, frame);
}

}  // namespace

std::vector<Radiance> read_radiances(const Session& session, const std::vector<FrameRecord>& frames,
                                     const WorkContext& work) {
    DarkFrames darks(session);
    std::vector<std::optional<cv::Mat3f>> dark_of;  // headers only: the pixels are shared
    for (const FrameRecord& frame : frames)
        dark_of.push_back(is_captured(frame) ? darks.for_frame(frame) : std::nullopt);
    std::vector<Radiance> read(frames.size());
    for (std::size_t first = 0; first < frames.size(); first += frames_at_once) {
        step(work, {"reading frames", first, frames.size(), basename_of(frames[first])});
        const std::size_t last = std::min(first + frames_at_once, frames.size());
        on_threads_of(work, [&] {
            tbb::parallel_for(first, last,
                              [&](std::size_t i) { read[i] = read_less_dark(session, frames[i], dark_of[i]); });
        });
    }
    return read;
}

}  // namespace darkbox
