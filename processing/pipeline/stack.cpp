#include "processing/pipeline/stack.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>

#include "acquisition/frame/error.h"
#include "processing/formats/calibration_file.h"
#include "processing/formats/picture.h"
#include "processing/maps/parallel.h"
#include "processing/maps/require.h"
#include "processing/pipeline/radiance.h"
#include "processing/pipeline/session_files.h"
#include "processing/pipeline/steps.h"

namespace darkbox {
namespace {

/// Balls that the calibration found in view beside the object.
std::vector<cv::Vec3d> balls_in_view(const Session& session) {
    const ResultFiles files(session.folder());
    if (!photographs_of(session, FrameKind::ball).empty() || !std::filesystem::exists(files.calibration)) return {};
    std::vector<cv::Vec3d> discs;
    for (const Ball& ball : read_calibration(files.calibration).calibration.balls)
        discs.emplace_back(ball.x, ball.y, ball.radius);
    return discs;
}

}  // namespace

std::vector<FrameRecord> require_lit(const Session& session) {
    std::vector<FrameRecord> lit = photographs_of(session, FrameKind::lit);
    if (lit.empty())
        throw InputError(fmt::format("{} has no lit frame", session.folder().string()),
                         "capture or import photographs with a lamp on");
    return lit;
}

PhotoStack load_stack(const Session& session, const WorkContext& work) {
    const std::vector<FrameRecord> lit = require_lit(session);
    PhotoStack stack;
    for (Radiance& radiance : read_radiances(session, lit, work)) {
        stack.images.push_back(std::move(radiance.image));
        stack.clipped.push_back(std::move(radiance.clipped));
    }
    for (const FrameRecord& frame : lit) stack.files.push_back(basename_of(frame));
    const auto mask = extra_of(session, object_mask);
    stack.mask = mask ? read_mask(*mask) : automatic_mask(stack.images, balls_in_view(session));
    require_consistent(stack);
    return stack;
}

cv::Mat1b load_mask(const Session& session, const WorkContext& work) {
    constexpr int rows_at_once = 64;
    SessionPhotos photos(session);
    if (extra_of(session, object_mask)) return photos.mask();
    const int height = photos.size().height;
    PhotoBand band;
    for (int row = 0; row < height; row += rows_at_once) {
        step(work, {"finding the object", static_cast<std::size_t>(row), static_cast<std::size_t>(height), ""});
        on_threads_of(work, [&] { photos.read_next(std::min(rows_at_once, height - row), band); });
    }
    return photos.mask();
}

SessionPhotos::SessionPhotos(const Session& session) : session_(session) {
    frames_.emplace(session, require_lit(session));
    if (const auto mask = extra_of(session, object_mask)) {
        given_mask_ = read_mask(*mask);
        require_size("the mask", given_mask_->size(), size());
    } else {
        balls_ = balls_in_view(session);
        brightest_ = cv::Mat1f(size(), 0.0F);
    }
    const std::size_t samples = static_cast<std::size_t>(size().area()) * count();
    for (const FrameRecord& frame : require_lit(session)) files_.push_back(basename_of(frame));
    keep_every_ = static_cast<int>((samples + most_kept_samples - 1) / most_kept_samples);
}

std::size_t SessionPhotos::bytes_held() const {
    const std::size_t kept =
        std::min(most_kept_samples, static_cast<std::size_t>(size().area()) * count()) * sizeof(cv::Vec3f);
    return kept + static_cast<std::size_t>(size().area()) * (given_mask_ ? sizeof(uchar) : sizeof(float));
}

void SessionPhotos::read_next(int rows, PhotoBand& band) {
    frames_->read_next(rows, band);
    if (given_mask_)
        band.mask = given_mask_->rowRange(band.first_row, band.first_row + rows);
    else
        look_for_brightest(band);
    keep_rows(band);
}

void SessionPhotos::rewind() {
    frames_.emplace(session_, require_lit(session_));
    kept_.clear();
}

void SessionPhotos::look_for_brightest(const PhotoBand& band) {
    tbb::parallel_for(0, band.rows(), [&](int row) {
        std::vector<cv::Vec3f> radiance(static_cast<std::size_t>(band.cols()));
        float* most = brightest_[band.first_row + row];
        for (const PhotoRows& photo : band.photos) {
            radiance_row(photo, row, radiance.data());
            for (std::size_t x = 0; x < radiance.size(); ++x)
                most[x] = std::max(most[x], (radiance[x][0] + radiance[x][1] + radiance[x][2]) / 3.0F);
        }
    });
}

void SessionPhotos::keep_rows(const PhotoBand& band) {
    kept_.resize(band.photos.size());
    for (std::size_t i = 0; i < kept_.size(); ++i) {
        PhotoRows kept = band.photos[i];  // what makes radiance of them
        kept.samples = std::move(kept_[i].samples);
        kept.dark = std::move(kept_[i].dark);
        kept.clipped = std::move(kept_[i].clipped);
        for (int row = 0; row < band.rows(); ++row) {
            if ((band.first_row + row) % keep_every_ != 0) continue;
            kept.samples.push_back(band.photos[i].samples.row(row));
            if (!band.photos[i].dark.empty()) kept.dark.push_back(band.photos[i].dark.row(row));
            if (!band.photos[i].clipped.empty()) kept.clipped.push_back(band.photos[i].clipped.row(row));
        }
        kept_[i] = std::move(kept);
    }
}

cv::Mat1b SessionPhotos::mask() const { return given_mask_ ? *given_mask_ : mask_of_brightest(brightest_, balls_); }

PhotoStack SessionPhotos::kept_stack() const {
    PhotoStack stack;
    stack.files = files_;
    stack.mask = kept_mask();
    for (const PhotoRows& rows : kept_) {
        stack.images.push_back(radiance_of(rows));
        stack.clipped.push_back(clipped_of(rows));
    }
    return stack;
}

cv::Mat1b SessionPhotos::kept_mask() const {
    const cv::Mat1b whole = mask();
    cv::Mat1b kept;
    for (int row = 0; row < whole.rows; row += keep_every_) kept.push_back(whole.row(row));
    return kept;
}

}  // namespace darkbox
