#include "processing/transfer/kd_tree.h"

#include <algorithm>
#include <array>
#include <functional>
#include <limits>
#include <numeric>
#include <utility>

namespace darkbox {
namespace {

constexpr std::size_t leaf_size = 16;
/// Coordinate of the places of a leaf that hold no point: far from any query, and its square still finite.
constexpr float far_away = 1e15F;

using Bin = std::pair<float, std::size_t>;  ///< squared distance to a node's box, the node

bool before(const Match& a, const Match& b) {
    return std::pair(a.squared_distance, a.point) < std::pair(b.squared_distance, b.point);
}

/// With room for the rounding of sums of squares in two orders.
bool may_be_nearer(float lower_bound, const Match& best) {
    constexpr float rounding = 1e-4F;
    return lower_bound * (1 - rounding) < best.squared_distance;
}

std::size_t leaves_for(std::size_t points) {
    std::size_t leaves = 1;
    while (leaves * leaf_size < points) leaves *= 2;
    return leaves;
}

float limit_of(const std::vector<Match>& matches, std::size_t count, float squared_radius) {
    return matches.size() < count ? squared_radius : matches.back().squared_distance;
}

std::size_t widest(const float* lowest, const float* highest, std::size_t dimensions) {
    std::size_t best = 0;
    for (std::size_t d = 1; d < dimensions; ++d)
        if (highest[d] - lowest[d] > highest[best] - lowest[best]) best = d;
    return best;
}

}  // namespace

KdTree::KdTree(const PointSet& points)
    : dimensions_(points.dimensions),
      leaves_(leaves_for(points.size())),
      boxes_(2 * leaves_ * 2 * dimensions_),
      blocks_(leaves_ * dimensions_ * leaf_size, far_away),
      points_(leaves_ * leaf_size, -1) {
    std::vector<int> order(points.size());
    std::iota(order.begin(), order.end(), 0);
    build(points, order, 1, 0, order.size());
}

void KdTree::build(const PointSet& points, std::vector<int>& order, std::size_t node, std::size_t begin,
                   std::size_t end) {
    float* lowest = boxes_.data() + node * 2 * dimensions_;
    float* highest = lowest + dimensions_;
    std::fill(lowest, highest, std::numeric_limits<float>::max());
    std::fill(highest, highest + dimensions_, std::numeric_limits<float>::lowest());
    for (std::size_t i = begin; i < end; ++i)
        for (std::size_t d = 0; d < dimensions_; ++d) {
            lowest[d] = std::min(lowest[d], points[order[i]][d]);
            highest[d] = std::max(highest[d], points[order[i]][d]);
        }
    if (node >= leaves_) {
        fill_leaf(points, order.data() + begin, order.data() + end, node - leaves_);
        return;
    }
    const std::size_t axis = widest(lowest, highest, dimensions_);
    const std::size_t middle = begin + (end - begin) / 2;
    std::nth_element(order.begin() + begin, order.begin() + middle, order.begin() + end,
                     [&](int a, int b) { return std::pair(points[a][axis], a) < std::pair(points[b][axis], b); });
    build(points, order, 2 * node, begin, middle);
    build(points, order, 2 * node + 1, middle, end);
}

void KdTree::fill_leaf(const PointSet& points, const int* begin, const int* end, std::size_t leaf) {
    float* block = blocks_.data() + leaf * dimensions_ * leaf_size;
    for (const int* point = begin; point != end; ++point) {
        const std::size_t place = point - begin;
        points_[leaf * leaf_size + place] = *point;
        for (std::size_t d = 0; d < dimensions_; ++d) block[d * leaf_size + place] = points[*point][d];
    }
}

float KdTree::squared_distance_to_box(const float* query, std::size_t node) const {
    const float* lowest = boxes_.data() + node * 2 * dimensions_;
    const float* highest = lowest + dimensions_;
    float sum = 0;
    for (std::size_t d = 0; d < dimensions_; ++d) {
        const float outside = std::max(0.0F, std::max(lowest[d] - query[d], query[d] - highest[d]));
        sum += outside * outside;
    }
    return sum;
}

void KdTree::leaf_distances(const float* query, std::size_t leaf, float* distances) const {
    std::array<float, leaf_size> sums{};
    const float* block = blocks_.data() + leaf * dimensions_ * leaf_size;
    for (std::size_t d = 0; d < dimensions_; ++d)
        for (std::size_t i = 0; i < leaf_size; ++i) {
            const float difference = block[d * leaf_size + i] - query[d];
            sums[i] += difference * difference;
        }
    std::copy(sums.begin(), sums.end(), distances);
}

void KdTree::read_leaf(const float* query, std::size_t leaf, std::size_t count, float squared_radius,
                       std::vector<Match>& matches) const {
    std::array<float, leaf_size> distances{};
    leaf_distances(query, leaf, distances.data());
    for (std::size_t i = 0; i < leaf_size; ++i) {
        const Match match{points_[leaf * leaf_size + i], distances[i]};
        if (match.point < 0 || !(match.squared_distance < limit_of(matches, count, squared_radius))) continue;
        if (matches.size() == count) matches.pop_back();
        matches.insert(std::upper_bound(matches.begin(), matches.end(), match, before), match);
    }
}

void KdTree::nearest(const float* query, std::size_t count, float squared_radius, int most_leaves,
                     std::vector<Match>& matches) const {
    matches.clear();
    std::vector<Bin> heap{{squared_distance_to_box(query, 1), 1}};
    for (int leaves_read = 0; !heap.empty() && leaves_read < most_leaves;) {
        std::pop_heap(heap.begin(), heap.end(), std::greater<>());
        auto [distance, node] = heap.back();
        heap.pop_back();
        if (!(distance < limit_of(matches, count, squared_radius))) break;
        while (node < leaves_) {
            Bin near{squared_distance_to_box(query, 2 * node), 2 * node};
            Bin far{squared_distance_to_box(query, 2 * node + 1), 2 * node + 1};
            if (far < near) std::swap(near, far);
            heap.push_back(far);
            std::push_heap(heap.begin(), heap.end(), std::greater<>());
            node = near.second;
        }
        read_leaf(query, node - leaves_, count, squared_radius, matches);
        ++leaves_read;
    }
}

Match KdTree::nearest_by(const Distance& distance, const float* query, float squared_radius) const {
    Match best{-1, squared_radius};
    nearest_by(distance, query, 1, best);
    return best;
}

void KdTree::nearest_by(const Distance& distance, const float* query, std::size_t node, Match& best) const {
    if (node < leaves_) {
        Bin near{squared_distance_to_box(query, 2 * node), 2 * node};
        Bin far{squared_distance_to_box(query, 2 * node + 1), 2 * node + 1};
        if (far < near) std::swap(near, far);
        for (const Bin& bin : {near, far})
            if (may_be_nearer(bin.first, best)) nearest_by(distance, query, bin.second, best);
        return;
    }
    const std::size_t leaf = node - leaves_;
    std::array<float, leaf_size> distances{};
    leaf_distances(query, leaf, distances.data());
    for (std::size_t i = 0; i < leaf_size; ++i) {
        const int point = points_[leaf * leaf_size + i];
        if (point < 0 || !may_be_nearer(distances[i], best)) continue;
        const Match match{point, distance(point, best.squared_distance)};
        if (match.squared_distance < best.squared_distance) best = match;
    }
}

}  // namespace darkbox
