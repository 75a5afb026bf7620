#include "processing/transfer/seed.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <limits>

#include "processing/transfer/counter_hash.h"

namespace darkbox {
namespace {

const cv::Vec2i outside(-1, -1);

class Seeding {
public:
    Seeding(const MapLevel& source, const NormalTable& table, const MapLevel& target, const SeedOptions& options)
        : source_(source), table_(table), target_(target), options_(options) {}

    cv::Vec2i pixel(cv::Point p) const {
        for (int spacing = options_.largest_chunk; spacing > 1; spacing /= 2) {
            const cv::Point q = nearest_grid_point(p, spacing);
            if (!target_.has(q)) continue;
            const cv::Point at = picked(q, spacing) + p - q;
            if (!source_.has(at)) continue;
            const cv::Vec3f off = source_.normal(at) - target_.normal(p);
            if (off.dot(off) < options_.threshold * options_.threshold) return {at.x, at.y};
        }
        const cv::Point at = picked(p, 1);
        return {at.x, at.y};
    }

private:
    const MapLevel& source_;
    const NormalTable& table_;
    const MapLevel& target_;
    const SeedOptions& options_;

    std::uint32_t random(cv::Point p, int spacing, std::uint64_t purpose) const {
        return counter_hash(static_cast<std::uint32_t>(p.x), static_cast<std::uint32_t>(p.y),
                            (options_.seed * 64 + static_cast<std::uint64_t>(spacing)) * 2 + purpose);
    }

    /// Of the jittered points of the nine grid cells around p.
    cv::Point nearest_grid_point(cv::Point p, int spacing) const {
        cv::Point best;
        int nearest = std::numeric_limits<int>::max();
        for (int j = -1; j <= 1; ++j)
            for (int i = -1; i <= 1; ++i) {
                const cv::Point cell(p.x / spacing + i, p.y / spacing + j);
                const std::uint32_t r = random(cell, spacing, 0);
                const cv::Point q = cell * spacing + cv::Point(static_cast<int>(r & 0xffffU) % spacing,
                                                               static_cast<int>(r >> 16) % spacing);
                const cv::Point d = q - p;
                if (d.dot(d) < nearest) {
                    nearest = d.dot(d);
                    best = q;
                }
            }
        return best;
    }

    cv::Point picked(cv::Point q, int spacing) const {
        constexpr std::uint32_t middle = 0x80000000U;
        const auto offset = static_cast<float>(random(q, spacing, 1)) - static_cast<float>(middle);
        const auto jittered = static_cast<std::int64_t>(middle) + static_cast<std::int64_t>(offset * options_.jitter);
        return table_.pick(normal_bin(target_.normal(q)), static_cast<std::uint32_t>(std::clamp<std::int64_t>(
                                                              jittered, 0, std::numeric_limits<std::uint32_t>::max())));
    }
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
