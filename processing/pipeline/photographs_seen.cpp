#include "processing/pipeline/photographs_seen.h"

#include <tbb/parallel_for.h>

#include <algorithm>

#include "processing/maps/parallel.h"
#include "processing/maps/require.h"
#include "processing/pipeline/radiance.h"
#include "processing/pipeline/session_files.h"
#include "processing/pipeline/stack.h"

namespace darkbox {
namespace {

using Row = std::vector<cv::Vec3f>;

void raise(cv::Vec3f* most, const Row& radiance, bool first) {
    for (std::size_t x = 0; x < radiance.size(); ++x)
        for (int c = 0; c < 3; ++c) most[x][c] = first ? radiance[x][c] : std::max(most[x][c], radiance[x][c]);
}

void count(const Row& radiance, const uchar* inside, std::vector<std::size_t>& bins) {
    for (std::size_t x = 0; x < radiance.size(); ++x) {
        if (inside[x] == 0) continue;
        const cv::Vec3f& p = radiance[x];
        const double value = std::clamp<double>(std::max({p[0], p[1], p[2]}), 0.0, 1.0);
        ++bins[std::min(static_cast<std::size_t>(value * static_cast<double>(bins.size())), bins.size() - 1)];
    }
}

std::vector<double> shares(const std::vector<std::vector<std::size_t>>& by_row) {
    std::vector<double> shares(by_row.front().size(), 0.0);
    double all = 0;
    for (const auto& row : by_row)
        for (std::size_t bin = 0; bin < row.size(); ++bin) {
            shares[bin] += static_cast<double>(row[bin]);
            all += static_cast<double>(row[bin]);
        }
    for (double& share : shares) share /= std::max(all, 1.0);
    return shares;
}

}  // namespace

PhotographsSeen see_photographs(const Session& session, std::size_t bins, const WorkContext& work) {
    PhotographsSeen seen;
    seen.mask = load_mask(session, work);
    FrameBands photographs(session, require_lit(session));
    const cv::Size size = photographs.size();
    require_size("the mask", seen.mask.size(), size);
    seen.photographs = photographs.count();
    seen.mean = cv::Mat3f(size, cv::Vec3f(0, 0, 0));
    seen.brightest = cv::Mat3f(size);
    const auto height = static_cast<std::size_t>(size.height);
    std::vector<std::vector<std::size_t>> counts(height, std::vector<std::size_t>(bins));
    for_bands(photographs, work, {"reading frames", 0, height, ""}, [&](const PhotoBand& band) {
        tbb::parallel_for(0, band.rows(), [&](int row) {
            const int y = band.first_row + row;
            Row radiance(static_cast<std::size_t>(band.cols()));
            cv::Vec3f* sum = seen.mean[y];
            for (std::size_t i = 0; i < band.photos.size(); ++i) {
                radiance_row(band.photos[i], row, radiance.data());
                for (std::size_t x = 0; x < radiance.size(); ++x) sum[x] += radiance[x];
                raise(seen.brightest[y], radiance, i == 0);
                count(radiance, seen.mask[y], counts[static_cast<std::size_t>(y)]);
            }
        });
    });
    seen.mean /= static_cast<double>(seen.photographs);
    seen.exposure = shares(counts);
    return seen;
}

cv::Mat3f brightest_of_ball(const Session& session, const WorkContext& work) {
    FrameBands frames(session, photographs_of(session, FrameKind::ball));
    cv::Mat3f brightest(frames.size());
    const auto height = static_cast<std::size_t>(frames.size().height);
    for_bands(frames, work, {"reading frames of the ball", 0, height, ""}, [&](const PhotoBand& band) {
        tbb::parallel_for(0, band.rows(), [&](int row) {
            Row radiance(static_cast<std::size_t>(band.cols()));
            for (std::size_t i = 0; i < band.photos.size(); ++i) {
                radiance_row(band.photos[i], row, radiance.data());
                raise(brightest[band.first_row + row], radiance, i == 0);
            }
        });
    });
    return brightest;
}

}  // namespace darkbox
