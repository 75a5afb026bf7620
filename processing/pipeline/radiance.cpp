#include "processing/pipeline/radiance.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>

#include "acquisition/frame/error.h"
#include "processing/maps/parallel.h"
#include "processing/maps/srgb.h"
#include "processing/pipeline/frame_rows.h"
#include "processing/pipeline/open_files.h"
#include "processing/pipeline/session_files.h"
#include "processing/pipeline/steps.h"

namespace darkbox {
namespace {

constexpr int rows_at_once = 64;
constexpr std::size_t libraries_files = 64;  // what else may be open

/// Exposure and gain: what a lamps-off frame must share with the frame that it is taken from.
bool same_controls(const FrameRecord& a, const FrameRecord& b) {
    const auto near = [](double p, double q) { return std::abs(p - q) <= 1e-6 * std::max(std::abs(p), std::abs(q)); };
    return near(a.exposure_s, b.exposure_s) && near(a.gain, b.gain) && a.width == b.width && a.height == b.height;
}

}  // namespace

std::shared_ptr<const std::vector<float>> srgb_curve(int full_scale) {
    std::vector<float> curve(static_cast<std::size_t>(full_scale) + 1);
    for (std::size_t i = 0; i < curve.size(); ++i)
        curve[i] = linear_from_srgb(static_cast<float>(static_cast<double>(i) / full_scale));
    return std::make_shared<const std::vector<float>>(std::move(curve));
}

/// The mean of the lamps-off frames of one exposure and gain, row by row.
class FrameBands::Dark {
public:
    Dark(const Session& session, const FrameRecord& like) : like_(like) {
        for (const FrameRecord& dark : frames_of_kind(session, FrameKind::dark))
            if (is_captured(dark) && same_controls(dark, like)) frames_.push_back(open_frame_rows(session, dark));
    }

    bool fits(const FrameRecord& frame) const { return same_controls(like_, frame); }
    bool empty() const { return frames_.empty(); }

    /// In sample units.
    void read_next(int rows, cv::Size size) {
        mean_ = cv::Mat3f(rows, size.width, cv::Vec3f::all(0));
        cv::Mat samples, wide;
        for (const auto& frame : frames_) {
            frame->read(rows, samples);
            samples.convertTo(wide, CV_32F);
            mean_ += wide;
        }
        mean_ /= static_cast<double>(frames_.size());
    }
    const cv::Mat3f& mean() const { return mean_; }

private:
    FrameRecord like_;
    std::vector<std::unique_ptr<FrameRows>> frames_;
    cv::Mat3f mean_;
};

/// One photograph and what makes radiance of its samples.
class FrameBands::Frame {
public:
    Frame(const Session& session, const FrameRecord& record, const Dark* dark)
        : rows_(open_frame_rows(session, record)), dark_(dark), srgb_(record.transfer == TransferCurve::srgb) {
        const int depth = CV_MAT_DEPTH(rows_->type());
        if (depth == CV_32F) return;
        const double full_scale = is_captured(record) ? std::exp2(record.bit_depth) - 1.0
                                  : depth == CV_8U    ? 255
                                                      : 65535;
        const double black = is_captured(record) ? record.black_level : 0.0;
        form_.black = static_cast<float>(black);
        form_.scale = static_cast<float>(1.0 / (full_scale - black));
        form_.limit = static_cast<float>(full_scale);
        if (srgb_ && !is_captured(record)) form_.curve = srgb_curve(static_cast<int>(full_scale));
    }

    cv::Size size() const { return rows_->size(); }
    std::size_t bytes_per_pixel() const { return CV_ELEM_SIZE(rows_->type()); }

    void read_next(int rows, PhotoRows& photo) {
        cv::Mat samples = std::move(photo.samples);
        rows_->read(rows, samples);
        photo = form_;
        photo.samples = std::move(samples);
        if (dark_) photo.dark = dark_->mean();
        if (srgb_ && photo.samples.depth() == CV_32F) photo.samples = linear_from_srgb(cv::Mat3f(photo.samples));
    }

private:
    std::unique_ptr<FrameRows> rows_;
    const Dark* dark_;
    bool srgb_;
    PhotoRows form_;  ///< without samples
};

FrameBands::FrameBands(const Session& session, const std::vector<FrameRecord>& frames) {
    allow_open_files(frames.size() + libraries_files);
    for (const FrameRecord& record : frames) {
        const Dark* dark = is_captured(record) ? dark_for(session, record) : nullptr;
        frames_.push_back(std::make_unique<Frame>(session, record, dark));
        const cv::Size size = frames_.back()->size();
        if (frames_.size() == 1) size_ = size;
        if (size != size_)
            throw InputError(fmt::format("{} is {}x{} pixels but {} is {}x{}", record.file, size.width, size.height,
                                         frames.front().file, size_.width, size_.height),
                             "give photographs of one camera in one place, all of one size");
    }
}

FrameBands::~FrameBands() = default;

FrameBands::Dark* FrameBands::dark_for(const Session& session, const FrameRecord& frame) {
    auto known = std::find_if(darks_.begin(), darks_.end(), [&](const auto& dark) { return dark->fits(frame); });
    if (known == darks_.end()) known = darks_.insert(darks_.end(), std::make_unique<Dark>(session, frame));
    return (*known)->empty() ? nullptr : known->get();
}

std::size_t FrameBands::bytes_per_row() const {
    std::size_t bytes_per_pixel = darks_.size() * sizeof(cv::Vec3f);
    for (const auto& frame : frames_) bytes_per_pixel += frame->bytes_per_pixel();
    return bytes_per_pixel * static_cast<std::size_t>(size_.width);
}

void FrameBands::read_next(int rows, PhotoBand& band) {
    band.first_row = next_row_;
    band.photos.resize(frames_.size());
    tbb::parallel_for(std::size_t{0}, darks_.size(), [&](std::size_t i) {
        if (!darks_[i]->empty()) darks_[i]->read_next(rows, size_);
    });
    tbb::parallel_for(std::size_t{0}, frames_.size(),
                      [&](std::size_t i) { frames_[i]->read_next(rows, band.photos[i]); });
    next_row_ += rows;
}

std::vector<Radiance> read_radiances(const Session& session, const std::vector<FrameRecord>& frames,
                                     const WorkContext& work) {
    FrameBands bands(session, frames);
    std::vector<Radiance> read(frames.size());
    for (Radiance& radiance : read) radiance = {cv::Mat3f(bands.size()), cv::Mat1b(bands.size())};
    const int height = bands.size().height;
    PhotoBand band;
    for (int row = 0; row < height; row += rows_at_once) {
        step(work, {"reading frames", static_cast<std::size_t>(row), static_cast<std::size_t>(height), ""});
        const cv::Range rows(row, std::min(row + rows_at_once, height));
        on_threads_of(work, [&] {
            bands.read_next(rows.size(), band);
            tbb::parallel_for(std::size_t{0}, read.size(), [&](std::size_t i) {
                radiance_of(band.photos[i]).copyTo(read[i].image.rowRange(rows));
                clipped_of(band.photos[i]).copyTo(read[i].clipped.rowRange(rows));
            });
        });
    }
    return read;
}

}  // namespace darkbox
