#include "processing/pipeline/session_ball.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "acquisition/frame/error.h"
#include "processing/maps/maps.h"
#include "processing/maps/parallel.h"
#include "processing/pipeline/radiance.h"
#include "processing/pipeline/session_files.h"
#include "processing/pipeline/stack.h"
#include "processing/pipeline/steps.h"

namespace darkbox {
namespace {

constexpr const char* reading_ball = "reading frames";

/// The part of a box that lies in one row of the frame goes to its place in the part.
void copy_row(const std::vector<cv::Vec3f>& radiance, int y, const cv::Rect& box, cv::Mat3f& part) {
    if (y < box.y || y >= box.br().y) return;
    std::copy_n(radiance.begin() + box.x, box.width, part[y - box.y]);
}

}  // namespace

SessionBall::SessionBall(const Session& session, WorkContext work) : session_(session), work_(std::move(work)) {
    const std::vector<FrameRecord> lit = require_lit(session);
    const std::vector<FrameRecord> own = photographs_of(session, FrameKind::ball);
    if (!own.empty() && own.size() != lit.size())
        throw InputError(fmt::format("{} has {} frames of the ball for {} of the object", session.folder().string(),
                                     own.size(), lit.size()),
                         "photograph the ball once under each lamp");
    separate_ = !own.empty();
    frames_ = separate_ ? own : lit;
    for (const FrameRecord& frame : lit) files_.push_back(basename_of(frame));
    size_ = FrameBands(session, frames_).size();
}

BallOverview SessionBall::overview(int reduced_side) {
    Stopwatch watch;
    const Reduction reduction(size_, std::max(reduced_side, 1));
    const auto area = static_cast<std::size_t>(size_.area()), height = static_cast<std::size_t>(size_.height);
    const std::size_t at_once = reduced_side > 0 ? pictures_at_once(area * sizeof(float)) : count();
    BallOverview overview;
    overview.reduced.scale = reduction.scale();
    cv::Mat1d sum(size_, 0.0);
    for (std::size_t first = 0; first < count(); first += at_once) {
        const std::size_t some = std::min(at_once, count() - first);
        const auto begin = frames_.begin() + static_cast<std::ptrdiff_t>(first);
        FrameBands bands(session_, {begin, begin + static_cast<std::ptrdiff_t>(some)});
        const std::size_t passes = (count() + at_once - 1) / at_once, pass = first / at_once;
        std::vector<cv::Mat1f> pictures(reduced_side > 0 ? some : 0), rows(some);
        for (cv::Mat1f& picture : pictures) picture = cv::Mat1f(size_);
        for_bands(bands, work_, {reading_ball, pass * height, passes * height, ""}, [&](const PhotoBand& band) {
            const cv::Range range(band.first_row, band.first_row + band.rows());
            tbb::parallel_for(std::size_t{0}, some, [&](std::size_t i) {
                rows[i] = mean_channel(radiance_of(band.photos[i]));
                if (!pictures.empty()) rows[i].copyTo(pictures[i].rowRange(range));
            });
            cv::Mat1d part = sum.rowRange(range);
            for (const cv::Mat1f& one : rows) cv::accumulate(one, part);
        });
        for (const cv::Mat1f& picture : pictures) overview.reduced.images.push_back(reduction.of(picture));
    }
    sum.convertTo(overview.mean, CV_32F, 1.0 / static_cast<double>(count()));
    seconds_ += watch.lap();
    return overview;
}

std::vector<std::vector<cv::Mat3f>> SessionBall::parts(const std::vector<cv::Rect>& boxes) {
    Stopwatch watch;
    std::vector<std::vector<cv::Mat3f>> parts(boxes.size(), std::vector<cv::Mat3f>(count()));
    for (std::size_t b = 0; b < boxes.size(); ++b)
        for (cv::Mat3f& part : parts[b]) part = cv::Mat3f(boxes[b].size());
    brightest_ = cv::Mat3f(size_);
    brightest_luminance_ = cv::Mat1f(size_, 0.0F);
    FrameBands bands(session_, frames_);
    for_bands(bands, work_, {reading_ball, 0, static_cast<std::size_t>(size_.height), ""}, [&](const PhotoBand& band) {
        tbb::parallel_for(0, band.rows(), [&](int row) {
            const int y = band.first_row + row;
            std::vector<cv::Vec3f> radiance(static_cast<std::size_t>(band.cols()));
            cv::Vec3f* most = brightest_[y];
            float* luminance = brightest_luminance_[y];
            for (std::size_t i = 0; i < band.photos.size(); ++i) {
                radiance_row(band.photos[i], row, radiance.data());
                for (std::size_t b = 0; b < boxes.size(); ++b) copy_row(radiance, y, boxes[b], parts[b][i]);
                for (std::size_t x = 0; x < radiance.size(); ++x) {
                    const cv::Vec3f& p = radiance[x];
                    for (int c = 0; c < 3; ++c) most[x][c] = i == 0 ? p[c] : std::max(most[x][c], p[c]);
                    luminance[x] = std::max(luminance[x], (p[0] + p[1] + p[2]) / 3.0F);
                }
            }
        });
    });
    seconds_ += watch.lap();
    return parts;
}

}  // namespace darkbox
