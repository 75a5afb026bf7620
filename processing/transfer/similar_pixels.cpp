#include "processing/transfer/similar_pixels.h"

#include <tbb/parallel_for.h>

#include <cstdlib>
#include <limits>

#include "processing/transfer/nearest.h"

namespace darkbox {
namespace {

/// Pixels kept for each.
constexpr std::size_t kept = 2;

void read_window(const cv::Mat& bytes, cv::Point p, int window, Feature& feature) {
    feature.value.clear();
    for (int dy = 0; dy < window; ++dy) {
        const std::uint8_t* row = bytes.ptr(p.y + dy, p.x);
        feature.value.insert(feature.value.end(), row, row + window * static_cast<int>(bytes.elemSize()));
    }
}

}  // namespace

SimilarPixels::SimilarPixels(const cv::Mat& bytes, const cv::Mat1b& valid, int window, std::uint64_t seed)
    : place_(valid.size(), -1) {
    std::vector<cv::Point> pixels;
    for (int y = 0; y < valid.rows; ++y)
        for (int x = 0; x < valid.cols; ++x) {
            if (!valid(y, x)) continue;
            place_(y, x) = static_cast<int>(pixels.size());
            pixels.emplace_back(x, y);
        }
    found_.resize(kept * pixels.size());
    count_.resize(pixels.size());
    const NearestFeatures nearest(
        pixels.size(), [&](std::size_t i, Feature& feature) { read_window(bytes, pixels[i], window, feature); }, seed);
    tbb::parallel_for(std::size_t{0}, pixels.size(), [&](std::size_t i) {
        thread_local Feature feature;
        thread_local std::vector<float> query;
        thread_local std::vector<Match> matches;
        read_window(bytes, pixels[i], window, feature);
        nearest.short_list(feature, std::numeric_limits<float>::infinity(), query, matches);
        std::size_t count = 0;
        for (const Match& match : matches) {
            const cv::Point other = pixels[static_cast<std::size_t>(match.point)];
            const cv::Point apart = other - pixels[i];
            const bool elsewhere = std::abs(apart.x) > window / 2 || std::abs(apart.y) > window / 2;
            if (elsewhere && count < kept) found_[kept * i + count++] = other;
        }
        count_[i] = static_cast<int>(count);
    });
}

std::span<const cv::Point> SimilarPixels::of(cv::Point p) const {
    const auto place = static_cast<std::size_t>(place_(p));
    return {found_.data() + kept * place, static_cast<std::size_t>(count_[place])};
}

}  // namespace darkbox
