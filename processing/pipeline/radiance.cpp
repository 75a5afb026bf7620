#include "processing/pipeline/radiance.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>

#include "acquisition/frame/error.h"
#include "processing/maps/parallel.h"
#include "processing/maps/srgb.h"
#include "processing/pipeline/frame_rows.h"
#include "processing/pipeline/merge_exposures.h"
#include "processing/pipeline/open_files.h"
#include "processing/pipeline/session_files.h"
#include "processing/pipeline/steps.h"
#include "processing/pipeline/unlit_frames.h"

namespace darkbox {
namespace {

constexpr int most_rows = 64, least_rows = 16;  // of a band; decoders work on sixteen at once
constexpr std::size_t largest_band = 32UL << 20;
constexpr std::size_t whole_pictures = 512UL << 20;  // bytes
constexpr std::size_t libraries_files = 64;          // what else may be open

int rows_of_band(std::size_t bytes_per_row, int height) {
    const std::size_t fit = largest_band / std::max<std::size_t>(bytes_per_row, 1);
    return std::min(height, std::clamp(static_cast<int>(std::min<std::size_t>(fit, most_rows)), least_rows, most_rows));
}

}  // namespace

std::shared_ptr<const std::vector<float>> srgb_curve(int full_scale) {
    std::vector<float> curve(static_cast<std::size_t>(full_scale) + 1);
    for (std::size_t i = 0; i < curve.size(); ++i)
        curve[i] = linear_from_srgb(static_cast<float>(static_cast<double>(i) / full_scale));
    return std::make_shared<const std::vector<float>>(std::move(curve));
}

namespace {

double full_scale_of(const FrameRecord& record) { return std::exp2(record.bit_depth) - 1.0; }

/// One frame and what makes radiance of its samples.
class PlainPhoto final : public PhotoReader {
public:
    PlainPhoto(const Session& session, const FrameRecord& record, const UnlitFrames* unlit)
        : rows_(open_frame_rows(session, record)),
          record_(record),
          unlit_(unlit),
          srgb_(record.transfer == TransferCurve::srgb) {
        const int depth = CV_MAT_DEPTH(rows_->type());
        if (depth == CV_32F) return;
        const double full_scale = is_captured(record) ? full_scale_of(record) : depth == CV_8U ? 255 : 65535;
        const double black = is_captured(record) ? record.black_level : 0.0;
        form_.black = static_cast<float>(black);
        form_.scale = static_cast<float>(1.0 / (full_scale - black));
        form_.limit = static_cast<float>(full_scale);
        if (srgb_ && !is_captured(record)) form_.curve = srgb_curve(static_cast<int>(full_scale));
    }

    cv::Size size() const override { return rows_->size(); }
    std::size_t bytes_per_pixel() const override { return CV_ELEM_SIZE(rows_->type()); }

    void read_next(int rows, PhotoRows& photo) override {
        cv::Mat samples = std::move(photo.samples);
        rows_->read(rows, samples);
        photo = form_;
        photo.samples = std::move(samples);
        if (unlit_) photo.dark = unlit_->level_for(record_);
        if (srgb_ && photo.samples.depth() == CV_32F) photo.samples = linear_from_srgb(cv::Mat3f(photo.samples));
    }

private:
    std::unique_ptr<FrameRows> rows_;
    FrameRecord record_;
    const UnlitFrames* unlit_;
    bool srgb_;
    PhotoRows form_;  ///< without samples
};

/// Frames of one lamp, at one exposure or several, as one photograph.
class MergedPhoto final : public PhotoReader {
public:
    /// `unlit`: those of each frame; null where there are none.
    MergedPhoto(const Session& session, const std::vector<FrameRecord>& frames,
                const std::vector<const UnlitFrames*>& unlit)
        : gauge_(frames.front()) {
        for (std::size_t i = 0; i < frames.size(); ++i) {
            const auto same = [&](const Exposure& e) { return same_controls(e.frames.front().record, frames[i]); };
            auto known = std::find_if(exposures_.begin(), exposures_.end(), same);
            if (known == exposures_.end()) known = exposures_.emplace(exposures_.end());
            known->frames.push_back({frames[i], open_frame_rows(session, frames[i]), unlit[i]});
        }
    }

    cv::Size size() const override { return exposures_.front().frames.front().rows->size(); }
    std::size_t bytes_per_pixel() const override {
        return exposures_.size() * (2 * sizeof(cv::Vec3f) + sizeof(cv::Vec3b)) + 4 * sizeof(cv::Vec3f);
    }

    void read_next(int rows, PhotoRows& photo) override {
        std::vector<ExposureRows> read;
        for (const Exposure& exposure : exposures_) read.push_back(read_exposure(exposure, rows));
        MergedRows merged = merge_exposures(read);
        photo = PhotoRows();
        photo.samples = std::move(merged.radiance);
        photo.clipped = std::move(merged.clipped);
    }

private:
    struct OneFrame {
        FrameRecord record;
        std::unique_ptr<FrameRows> rows;
        const UnlitFrames* unlit = nullptr;
    };
    struct Exposure {
        std::vector<OneFrame> frames;
    };

    ExposureRows read_exposure(const Exposure& exposure, int count) const {
        const FrameRecord& first = exposure.frames.front().record;
        const cv::Size size(this->size().width, count);
        ExposureRows rows{.sum = cv::Mat3f(size, cv::Vec3f::all(0)),
                          .unlit = cv::Mat3f(size, cv::Vec3f::all(0)),
                          .clipped = cv::Mat3b(size, cv::Vec3b::all(0)),
                          .frames = static_cast<int>(exposure.frames.size()),
                          .unlit_frames = 0,
                          .full_scale = full_scale_of(first),
                          .radiance = 1,
                          .noise = first.noise.value_or(SensorNoise{})};
        const double sensitivity = first.exposure_s * first.gain / (gauge_.exposure_s * gauge_.gain);
        rows.radiance = 1 / ((rows.full_scale - first.black_level) * sensitivity);
        cv::Mat samples, wide;
        for (const OneFrame& frame : exposure.frames) {
            frame.rows->read(count, samples);
            samples.convertTo(wide, CV_32F);
            rows.sum += wide;
            mark_clipped(wide, rows);
            if (frame.unlit) {
                rows.unlit += frame.unlit->level_for(frame.record);
                rows.unlit_frames = frame.unlit->count();
            } else {
                rows.unlit += cv::Scalar::all(frame.record.black_level);
            }
        }
        rows.unlit /= static_cast<double>(exposure.frames.size());
        return rows;
    }

    static void mark_clipped(const cv::Mat& samples, ExposureRows& rows) {
        for (int row = 0; row < samples.rows; ++row) {
            const auto* sample = samples.ptr<float>(row);
            uchar* clipped = rows.clipped.ptr(row);
            for (int i = 0; i < 3 * samples.cols; ++i)
                if (sample[i] >= rows.full_scale) clipped[i] = 255;
        }
    }

    FrameRecord gauge_;  ///< in whose exposure and gain radiance 1 is full scale
    std::vector<Exposure> exposures_;
};

}  // namespace

FrameBands::FrameBands(const Session& session, const std::vector<FrameRecord>& photographs) {
    allow_open_files(photographs.size() + libraries_files);
    std::vector<FrameRecord> served;
    for (const FrameRecord& photograph : photographs)
        if (is_captured(photograph))
            for (const FrameRecord& frame : frames_of_photograph(session, photograph)) served.push_back(frame);
    for (const FrameRecord& photograph : photographs) {
        photos_.push_back(open(session, photograph, served));
        const cv::Size size = photos_.back()->size();
        if (photos_.size() == 1) size_ = size;
        if (size != size_)
            throw InputError(fmt::format("{} is {}x{} pixels but {} is {}x{}", photograph.file, size.width, size.height,
                                         photographs.front().file, size_.width, size_.height),
                             "give photographs of one camera in one place, all of one size");
    }
}

FrameBands::~FrameBands() = default;

std::unique_ptr<PhotoReader> FrameBands::open(const Session& session, const FrameRecord& photograph,
                                              const std::vector<FrameRecord>& served) {
    if (!is_captured(photograph)) return std::make_unique<PlainPhoto>(session, photograph, nullptr);
    const std::vector<FrameRecord> frames = frames_of_photograph(session, photograph);
    if (frames.size() == 1)
        return std::make_unique<PlainPhoto>(session, photograph, unlit_for(session, photograph, served));
    std::vector<const UnlitFrames*> unlit;
    for (const FrameRecord& frame : frames) unlit.push_back(unlit_for(session, frame, served));
    return std::make_unique<MergedPhoto>(session, frames, unlit);
}

const UnlitFrames* FrameBands::unlit_for(const Session& session, const FrameRecord& frame,
                                         const std::vector<FrameRecord>& served) {
    auto known = std::find_if(unlit_.begin(), unlit_.end(), [&](const auto& unlit) { return unlit->fits(frame); });
    if (known == unlit_.end())
        known = unlit_.insert(unlit_.end(), std::make_unique<UnlitFrames>(session, frame, served));
    return (*known)->empty() ? nullptr : known->get();
}

std::size_t FrameBands::bytes_per_row() const {
    std::size_t bytes_per_pixel = 0;
    for (const auto& unlit : unlit_) bytes_per_pixel += unlit->bytes_per_pixel();
    for (const auto& photo : photos_) bytes_per_pixel += photo->bytes_per_pixel();
    return bytes_per_pixel * static_cast<std::size_t>(size_.width);
}

void FrameBands::read_next(int rows, PhotoBand& band) {
    band.first_row = next_row_;
    band.photos.resize(photos_.size());
    tbb::parallel_for(std::size_t{0}, unlit_.size(), [&](std::size_t i) {
        if (!unlit_[i]->empty()) unlit_[i]->read_next(rows, size_);
    });
    tbb::parallel_for(std::size_t{0}, photos_.size(),
                      [&](std::size_t i) { photos_[i]->read_next(rows, band.photos[i]); });
    next_row_ += rows;
}

void for_bands(FrameBands& photographs, const WorkContext& work, ProgressUpdate progress,
               const std::function<void(const PhotoBand&)>& visit) {
    const int height = photographs.size().height;
    const int rows = rows_of_band(photographs.bytes_per_row(), height);
    PhotoBand current, next;
    on_threads_of(work, [&] { photographs.read_next(std::min(rows, height), current); });
    for (int seen = 0; seen < height; std::swap(current, next)) {
        step(work, progress);
        seen += current.rows();
        progress.done += static_cast<std::size_t>(current.rows());
        const int coming = std::min(rows, height - seen);
        on_threads_of(work, [&] {
            if (coming > 0)
                tbb::parallel_invoke([&] { photographs.read_next(coming, next); }, [&] { visit(current); });
            else
                visit(current);
        });
    }
}

std::size_t pictures_at_once(std::size_t bytes) {
    return std::max<std::size_t>(1, whole_pictures / std::max<std::size_t>(bytes, 1));
}

void for_radiances(const Session& session, const std::vector<FrameRecord>& frames, const WorkContext& work,
                   const std::function<void(std::size_t, const Radiance&)>& visit) {
    if (frames.empty()) return;
    const auto first_size = static_cast<std::size_t>(open_frame_rows(session, frames.front())->size().area());
    const std::size_t at_once = pictures_at_once(first_size * (sizeof(cv::Vec3f) + 1));
    for (std::size_t first = 0; first < frames.size(); first += at_once) {
        const auto begin = frames.begin() + static_cast<std::ptrdiff_t>(first);
        const auto end = frames.begin() + static_cast<std::ptrdiff_t>(std::min(first + at_once, frames.size()));
        const std::vector<Radiance> some = read_radiances(session, {begin, end}, work);
        for (std::size_t i = 0; i < some.size(); ++i) visit(first + i, some[i]);
    }
}

std::vector<Radiance> read_radiances(const Session& session, const std::vector<FrameRecord>& frames,
                                     const WorkContext& work) {
    FrameBands bands(session, frames);
    std::vector<Radiance> read(frames.size());
    for (Radiance& radiance : read) radiance = {cv::Mat3f(bands.size()), cv::Mat1b(bands.size())};
    const auto height = static_cast<std::size_t>(bands.size().height);
    for_bands(bands, work, {"reading frames", 0, height, ""}, [&](const PhotoBand& band) {
        const cv::Range rows(band.first_row, band.first_row + band.rows());
        tbb::parallel_for(std::size_t{0}, read.size(), [&](std::size_t i) {
            radiance_of(band.photos[i]).copyTo(read[i].image.rowRange(rows));
            clipped_of(band.photos[i]).copyTo(read[i].clipped.rowRange(rows));
        });
    });
    return read;
}

}  // namespace darkbox
