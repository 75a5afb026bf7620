#pragma once

#include <cstddef>
#include <functional>
#include <vector>

namespace darkbox {

/// Points of any dimension, one after the other.
struct PointSet {
    std::size_t dimensions = 0;
    std::vector<float> coordinates;

    std::size_t size() const { return dimensions == 0 ? 0 : coordinates.size() / dimensions; }
    const float* operator[](std::size_t i) const { return coordinates.data() + i * dimensions; }
};

struct Match {
    int point = -1;
    float squared_distance = 0;
};

/// A balanced k-d tree (Bentley 1975) searched best bin first (Beis and Lowe 1997): boxes in the order of their
/// distance to the query, until none can hold a nearer point or `most_leaves` have been read. The limit bounds the time
/// of a query, which in 16 dimensions an exact search does not. Nothing in it is random: the same points and query give
/// the same answer. Immutable after construction, thus thread-safe.
class KdTree {
public:
    explicit KdTree(const PointSet& points);

    /// The up to `count` nearest points within `squared_radius`, nearest first; `matches` is used again.
    void nearest(const float* query, std::size_t count, float squared_radius, int most_leaves,
                 std::vector<Match>& matches) const;

    /// The exact squared distance of a point, or anything not less than `squared_radius` where it is not nearer.
    using Distance = std::function<float(int point, float squared_radius)>;

    /// The nearest by another distance that is never less than the tree's, but for rounding: the tree's only tells what
    /// need not be looked at. Exact, and as slow as that makes it. No point where none is within `squared_radius`.
    Match nearest_by(const Distance& distance, const float* query, float squared_radius) const;

private:
    std::size_t dimensions_;
    std::size_t leaves_;         ///< a power of two; leaf i is node leaves_ + i of the implicit tree with root 1
    std::vector<float> boxes_;   ///< per node: its lowest coordinates, then its highest
    std::vector<float> blocks_;  ///< per leaf, dimension by dimension, the coordinates of its points
    std::vector<int> points_;    ///< per leaf, -1 where it is not full

    void build(const PointSet& points, std::vector<int>& order, std::size_t node, std::size_t begin, std::size_t end);
    void fill_leaf(const PointSet& points, const int* begin, const int* end, std::size_t leaf);
    float squared_distance_to_box(const float* query, std::size_t node) const;
    void leaf_distances(const float* query, std::size_t leaf, float* distances) const;
    void nearest_by(const Distance& distance, const float* query, std::size_t node, Match& best) const;
    void read_leaf(const float* query, std::size_t leaf, std::size_t count, float squared_radius,
                   std::vector<Match>& matches) const;
};

}  // namespace darkbox
