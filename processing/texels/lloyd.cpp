#include "processing/texels/lloyd.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

namespace darkbox {
namespace {

constexpr int tile = 48;  ///< points measured at a time: they fit the nearest cache with the centres

/// So many that threads are kept busy, so few that their sums stay within some tens of megabytes.
int most_blocks(int clusters, int dimensions) { return std::clamp((1 << 22) / (clusters * dimensions), 8, 64); }

float squared_length(const float* point, int dimensions) {
    std::array<float, 8> part{};
    int d = 0;
    for (; d + 8 <= dimensions; d += 8)
        for (int lane = 0; lane < 8; ++lane) part[lane] += point[d + lane] * point[d + lane];
    for (; d < dimensions; ++d) part[0] += point[d] * point[d];
    return std::accumulate(part.begin(), part.end(), 0.0F);
}

double squared_distance(const float* a, const float* b, int dimensions) {
    double sum = 0;
    for (int d = 0; d < dimensions; ++d) {
        const double difference = static_cast<double>(a[d]) - b[d];
        sum += difference * difference;
    }
    return sum;
}

}  // namespace

void ClusterSums::add(int cluster, const float* point) {
    double* row = sum[cluster];
    for (int d = 0; d < sum.cols; ++d) row[d] += point[d];
    ++count[cluster];
}

void ClusterSums::remove(int cluster, const float* point) {
    double* row = sum[cluster];
    for (int d = 0; d < sum.cols; ++d) row[d] -= point[d];
    --count[cluster];
}

void ClusterSums::add(const ClusterSums& other) {
    sum += other.sum;
    for (std::size_t c = 0; c < count.size(); ++c) count[c] += other.count[c];
}

Lloyd::Lloyd(const PointSource& points, const cv::Mat1f& centres)
    : points_(points),
      blocks_(points.count(), most_blocks(centres.rows, centres.cols)),
      centres_(centres.clone()),
      mean_(centres.cols),
      label_(points.count(), -1),
      squared_length_(points.count()),
      bounds_(points.count()),
      sums_(centres.rows, centres.cols) {
    for (int d = 0; d < centres_.cols; ++d) mean_[d] = static_cast<float>(cv::mean(centres_.col(d))[0]);
    for (int c = 0; c < centres_.rows; ++c)
        for (int d = 0; d < centres_.cols; ++d) centres_(c, d) -= mean_[d];
}

bool Lloyd::iterate() {
    const NearestCentres nearest(centres_);
    std::vector<ClusterSums> change(blocks_.count());
    blocks_.for_each([&](int block) { change[block] = assign_block(block, nearest); });
    bool changed = false;
    for (const ClusterSums& of_block : change) {
        if (of_block.count.empty()) continue;
        sums_.add(of_block);
        changed = true;
    }
    changed = revive() || changed;
    if (changed) move_centres();
    return changed;
}

/// What its points add to the sums and take from them; empty where all stay.
ClusterSums Lloyd::assign_block(int block, const NearestCentres& nearest) {
    ClusterSums change;
    std::vector<float> coordinates(static_cast<std::size_t>(tile) * centres_.cols);
    std::array<int, tile> waiting;
    int count = 0;
    const auto flush = [&] {
        assign(std::span(waiting).first(count), nearest, coordinates.data(), change);
        count = 0;
    };
    for (int point = blocks_.begin(block); point < blocks_.end(block); ++point) {
        if (stays(point)) continue;
        waiting[count++] = point;
        if (count == tile) flush();
    }
    flush();
    return change;
}

void Lloyd::assign(std::span<const int> points, const NearestCentres& nearest, float* coordinates,
                   ClusterSums& change) {
    read(points, coordinates);
    std::array<NearestCentres::Found, tile> found;
    nearest.find(coordinates, points.size(), found.data());
    const int dimensions = centres_.cols;
    // The most that rounding may have cost a squared distance, by the bound for sums of products.
    const float rounding = 0.5F * std::numeric_limits<float>::epsilon() * static_cast<float>(dimensions + 4);
    for (std::size_t i = 0; i < points.size(); ++i) {
        const int point = points[i];
        const float* at = coordinates + i * dimensions;
        int& label = label_[point];
        if (label < 0) squared_length_[point] = squared_length(at, dimensions);
        const float length = squared_length_[point];
        const float error = rounding * (length + squared_reach_);
        bounds_[point] = {std::sqrt(std::max(0.0F, length + 2 * found[i].score) + error),
                          std::sqrt(std::max(0.0F, length + 2 * found[i].second - error))};
        if (found[i].centre == label) continue;
        if (change.count.empty()) change = ClusterSums(centres_.rows, dimensions);
        if (label >= 0) change.remove(label, at);
        label = found[i].centre;
        change.add(label, at);
    }
}

/// Hamerly's test, after the bounds have given way to how far the centres went.
bool Lloyd::stays(int point) {
    const int label = label_[point];
    if (label < 0) return false;
    Bounds& bounds = bounds_[point];
    bounds.upper += drift_.of[label];
    bounds.lower -= label == drift_.farthest ? drift_.second : drift_.of[drift_.farthest];
    return bounds.upper < std::max(bounds.lower, half_gap_[label]);
}

/// Gives each centre without a point the one farthest from its own; whether there was any. The centres that the
/// algorithm starts from differ, so there is always a cluster of more than one point to take from.
bool Lloyd::revive() {
    bool revived = false;
    std::vector<float> at(centres_.cols);
    for (int dead = 0; dead < centres_.rows; ++dead) {
        if (sums_.count[dead] > 0) continue;
        const int point = farthest_that_is_not_alone();
        read({&point, 1}, at.data());
        sums_.remove(label_[point], at.data());
        sums_.add(dead, at.data());
        label_[point] = dead;
        bounds_[point] = {0, 0};
        revived = true;
    }
    return revived;
}

int Lloyd::farthest_that_is_not_alone() const {
    int farthest = -1;
    for (int i = 0; i < points_.count(); ++i)
        if (sums_.count[label_[i]] > 1 && (farthest < 0 || bounds_[i].upper > bounds_[farthest].upper)) farthest = i;
    return farthest;
}

void Lloyd::move_centres() {
    const cv::Mat1f before = centres_.clone();
    for (int c = 0; c < centres_.rows; ++c)
        for (int d = 0; d < centres_.cols; ++d) centres_(c, d) = static_cast<float>(sums_.sum(c, d) / sums_.count[c]);
    measure_drift(before);
    measure_gaps();
}

void Lloyd::measure_drift(const cv::Mat1f& before) {
    constexpr double upwards = 1 + 1e-6;  // a bound, in float
    drift_ = {std::vector<float>(centres_.rows), 0, 0};
    squared_reach_ = 0;
    for (int c = 0; c < centres_.rows; ++c) {
        drift_.of[c] = static_cast<float>(upwards * std::sqrt(squared_distance(centres_[c], before[c], centres_.cols)));
        squared_reach_ = std::max(squared_reach_, squared_length(centres_[c], centres_.cols));
        if (drift_.of[c] > drift_.of[drift_.farthest]) drift_.farthest = c;
    }
    for (int c = 0; c < centres_.rows; ++c)
        if (c != drift_.farthest) drift_.second = std::max(drift_.second, drift_.of[c]);
}

void Lloyd::measure_gaps() {
    constexpr double downwards = 1 - 1e-6;
    half_gap_.assign(centres_.rows, 0);
    tbb::parallel_for(0, centres_.rows, [&](int c) {
        double least = std::numeric_limits<double>::infinity();
        for (int other = 0; other < centres_.rows; ++other)
            if (other != c) least = std::min(least, squared_distance(centres_[c], centres_[other], centres_.cols));
        half_gap_[c] = static_cast<float>(0.5 * downwards * std::sqrt(least));
    });
}

void Lloyd::read(std::span<const int> points, float* to) const {
    points_.read(points, to);
    for (std::size_t i = 0; i < points.size(); ++i)
        for (int d = 0; d < centres_.cols; ++d) to[i * centres_.cols + d] -= mean_[d];
}

cv::Mat1f Lloyd::centres() const {
    cv::Mat1f absolute = centres_.clone();
    for (int c = 0; c < absolute.rows; ++c)
        for (int d = 0; d < absolute.cols; ++d) absolute(c, d) += mean_[d];
    return absolute;
}

double Lloyd::inertia() const {
    std::vector<double> partial(blocks_.count(), 0.0);
    blocks_.for_each([&](int block) {
        std::vector<float> at(centres_.cols);
        for (int point = blocks_.begin(block); point < blocks_.end(block); ++point) {
            read({&point, 1}, at.data());
            partial[block] += squared_distance(at.data(), centres_[label_[point]], centres_.cols);
        }
    });
    return std::accumulate(partial.begin(), partial.end(), 0.0);
}

}  // namespace darkbox
