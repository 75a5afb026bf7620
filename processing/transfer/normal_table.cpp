#include "processing/transfer/normal_table.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace darkbox {
namespace {

/// Swaps the halves of the octahedron: what looks away from the viewer is folded over the edges of the square.
void fold(float& x, float& y) {
    const float folded_x = std::copysign(1 - std::abs(y), x);
    y = std::copysign(1 - std::abs(x), y);
    x = folded_x;
}

int cell(float coordinate) {
    return std::clamp(static_cast<int>((coordinate * 0.5F + 0.5F) * normal_bin_side), 0, normal_bin_side - 1);
}

float centre(int cell) { return (static_cast<float>(cell) + 0.5F) * (2.0F / normal_bin_side) - 1; }

template <class Visit>
void each_valid(const MapLevel& level, const Visit& visit) {
    for (int y = 0; y < level.valid.rows; ++y)
        for (int x = 0; x < level.valid.cols; ++x)
            if (level.valid(y, x)) visit(normal_bin(level.normal(y, x)), cv::Point(x, y));
}

std::vector<int> nearest_filled(const std::vector<std::size_t>& first) {
    std::vector<int> filled;
    for (int bin = 0; bin < normal_bins; ++bin)
        if (first[bin] < first[bin + 1]) filled.push_back(bin);
    std::vector<cv::Vec3f> normals;
    for (const int bin : filled) normals.push_back(bin_normal(bin));
    std::vector<int> nearest(normal_bins);
    tbb::parallel_for(0, normal_bins, [&](int bin) {
        if (first[bin] < first[bin + 1]) {
            nearest[bin] = bin;
            return;
        }
        const cv::Vec3f normal = bin_normal(bin);
        float best = -2;
        for (std::size_t i = 0; i < filled.size(); ++i) {
            const float cosine = normal.dot(normals[i]);
            if (cosine > best) {
                best = cosine;
                nearest[bin] = filled[i];
            }
        }
    });
    return nearest;
}

}  // namespace

int normal_bin(const cv::Vec3f& normal) {
    const float sum = std::abs(normal[0]) + std::abs(normal[1]) + std::abs(normal[2]);
    if (!(sum > 0)) return normal_bins / 2 + normal_bin_side / 2;  // normals that cancelled out: towards the viewer
    float x = normal[0] / sum;
    float y = normal[1] / sum;
    if (normal[2] < 0) fold(x, y);
    return cell(y) * normal_bin_side + cell(x);
}

cv::Mat1i normal_bin_map(const MapLevel& level) {
    cv::Mat1i bins(level.valid.size(), -1);
    tbb::parallel_for(0, bins.rows, [&](int y) {
        for (int x = 0; x < bins.cols; ++x)
            if (level.valid(y, x)) bins(y, x) = normal_bin(level.normal(y, x));
    });
    return bins;
}

cv::Vec3f bin_normal(int bin) {
    float x = centre(bin % normal_bin_side);
    float y = centre(bin / normal_bin_side);
    const float z = 1 - std::abs(x) - std::abs(y);
    if (z < 0) fold(x, y);
    const cv::Vec3f n(x, y, z);
    return n * (1 / std::sqrt(n.dot(n)));
}

NormalTable::NormalTable(const MapLevel& level) : first_(normal_bins + 1, 0) {
    each_valid(level, [&](int bin, cv::Point) { ++first_[bin + 1]; });
    for (int bin = 0; bin < normal_bins; ++bin) first_[bin + 1] += first_[bin];
    pixels_.resize(first_.back());
    std::vector<std::size_t> next(first_.begin(), first_.end() - 1);
    each_valid(level, [&](int bin, cv::Point p) { pixels_[next[bin]++] = p; });
    nearest_filled_ = nearest_filled(first_);
}

}  // namespace darkbox
