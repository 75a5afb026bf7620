#include "processing/transfer/seed.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <limits>
#include <vector>

#include "processing/transfer/counter_hash.h"

namespace darkbox {
namespace {

const cv::Vec2i outside(-1, -1);

std::uint32_t random_at(cv::Point p, int spacing, const SeedOptions& options, std::uint64_t purpose) {
    return counter_hash(static_cast<std::uint32_t>(p.x), static_cast<std::uint32_t>(p.y),
                        (options.seed * 64 + static_cast<std::uint64_t>(spacing)) * 2 + purpose);
}

/// A source pixel with about the target's normal at q.
cv::Point picked_pixel(cv::Point q, int spacing, const NormalTable& table, const MapLevel& target,
                       const SeedOptions& options) {
    constexpr std::uint32_t middle = 0x80000000U;
    const auto offset = static_cast<float>(random_at(q, spacing, options, 1)) - static_cast<float>(middle);
    const auto jittered = static_cast<std::int64_t>(middle) + static_cast<std::int64_t>(offset * options.jitter);
    return table.pick(normal_bin(target.normal(q)), static_cast<std::uint32_t>(std::clamp<std::int64_t>(
                                                        jittered, 0, std::numeric_limits<std::uint32_t>::max())));
}

/// The jittered points of one grid, one for each of its cells and of those around the picture, and the source pixel
/// that each picks.
class SeedGrid {
public:
    struct Point {
        cv::Point at;
        cv::Point source;  ///< of those in the target
        bool in_target;
    };

    SeedGrid(int spacing, const NormalTable& table, const MapLevel& target, const SeedOptions& options)
        : spacing_(spacing), columns_(target.valid.cols / spacing + 3) {
        const int rows = target.valid.rows / spacing + 3;
        points_.resize(static_cast<std::size_t>(columns_) * rows);
        tbb::parallel_for(0, rows, [&](int j) {
            for (int i = 0; i < columns_; ++i) {
                Point& point = points_[static_cast<std::size_t>(j) * columns_ + i];
                const cv::Point cell(i - 1, j - 1);
                const std::uint32_t r = random_at(cell, spacing, options, 0);
                point.at = cell * spacing +
                           cv::Point(static_cast<int>(r & 0xffffU) % spacing, static_cast<int>(r >> 16) % spacing);
                point.in_target = target.has(point.at);
                if (point.in_target) point.source = picked_pixel(point.at, spacing, table, target, options);
            }
        });
    }

    /// Of the nine cells around p.
    const Point& nearest(cv::Point p) const {
        const Point* row = points_.data() + static_cast<std::size_t>(p.y / spacing_) * columns_ + p.x / spacing_;
        const Point* best = nullptr;
        int nearest = std::numeric_limits<int>::max();
        for (int j = 0; j < 3; ++j, row += columns_)
            for (int i = 0; i < 3; ++i) {
                const cv::Point d = row[i].at - p;
                const int squared = d.x * d.x + d.y * d.y;
                if (squared >= nearest) continue;
                nearest = squared;
                best = row + i;
            }
        return *best;
    }

private:
    int spacing_;
    int columns_;
    std::vector<Point> points_;
};

class Seeding {
public:
    Seeding(const MapLevel& source, const NormalTable& table, const MapLevel& target, const SeedOptions& options)
        : source_(source), table_(table), target_(target), options_(options) {
        for (int spacing = options.largest_chunk; spacing > 1; spacing /= 2)
            grids_.emplace_back(spacing, table, target, options);
    }

    cv::Vec2i pixel(cv::Point p) const {
        for (const SeedGrid& grid : grids_) {
            const SeedGrid::Point& seed = grid.nearest(p);
            if (!seed.in_target) continue;
            const cv::Point at = seed.source + p - seed.at;
            if (!source_.has(at)) continue;
            const cv::Vec3f off = source_.normal(at) - target_.normal(p);
            if (off.dot(off) < options_.threshold * options_.threshold) return {at.x, at.y};
        }
        const cv::Point at = picked_pixel(p, 1, table_, target_, options_);
        return {at.x, at.y};
    }

private:
    const MapLevel& source_;
    const NormalTable& table_;
    const MapLevel& target_;
    const SeedOptions& options_;
    std::vector<SeedGrid> grids_;
};

}  // namespace

SeedOptions seed_options(const TransferOptions& options) {
    SeedOptions seeds;
    seeds.jitter = static_cast<float>(options.jitter);
    seeds.seed = options.seed;
    return seeds;
}

cv::Mat2i seed_coordinates(const MapLevel& source, const NormalTable& table, const MapLevel& target,
                           const SeedOptions& options) {
    const Seeding seeding(source, table, target, options);
    cv::Mat2i coordinates(target.valid.size(), outside);
    tbb::parallel_for(0, coordinates.rows, [&](int y) {
        for (int x = 0; x < coordinates.cols; ++x)
            if (target.valid(y, x)) coordinates(y, x) = seeding.pixel({x, y});
    });
    return coordinates;
}

cv::Mat2i refined_coordinates(const cv::Mat2i& coarse, const cv::Mat1b& source, const cv::Mat1b& target) {
    const auto child = [&](cv::Point parent, cv::Point wanted) {
        const auto valid = [&](cv::Point p) { return p.x < source.cols && p.y < source.rows && source(p) != 0; };
        cv::Point at = 2 * parent + wanted;
        for (int i = 0; !valid(at); ++i) at = 2 * parent + cv::Point(i % 2, i / 2);
        return cv::Vec2i(at.x, at.y);
    };
    cv::Mat2i fine(target.size(), outside);
    tbb::parallel_for(0, fine.rows, [&](int y) {
        for (int x = 0; x < fine.cols; ++x)
            if (target(y, x)) fine(y, x) = child(cv::Point(coarse(y / 2, x / 2)), {x % 2, y % 2});
    });
    return fine;
}

}  // namespace darkbox
