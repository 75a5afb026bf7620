#include "processing/normals/aggregates.h"

#include <algorithm>

namespace darkbox {
namespace {

constexpr float weak = 0.05F;  // of the lesser of two nodes' strongest differences

/// A picture's pixels as nodes of a graph.
struct GridNodes {
    const PixelGrid& grid;
    const DifferenceWeights& weights;

    std::size_t size() const { return grid.size(); }
    template <class Body>
    void neighbours(std::size_t i, Body&& body) const {
        if (i < grid.begin() || i >= grid.end()) return;
        const std::size_t stride = grid.stride();
        if (weights.down[i - stride] > 0) body(i - stride, weights.down[i - stride]);
        if (weights.right[i - 1] > 0) body(i - 1, weights.right[i - 1]);
        if (weights.right[i] > 0) body(i + 1, weights.right[i]);
        if (weights.down[i] > 0) body(i + stride, weights.down[i]);
    }
    int block_x(std::size_t i) const { return static_cast<int>(i % grid.stride()) / 2; }
    int block_y(std::size_t i) const { return (static_cast<int>(i / grid.stride()) - 1) / 2; }
};

struct GraphNodes {
    const CoarseGraph& graph;

    std::size_t size() const { return graph.nodes(); }
    template <class Body>
    void neighbours(std::size_t i, Body&& body) const {
        for (int e = graph.start[i]; e < graph.start[i + 1]; ++e)
            body(static_cast<std::size_t>(graph.neighbour[e]), graph.weight[e]);
    }
    int block_x(std::size_t i) const { return graph.block_x[i] / 2; }
    int block_y(std::size_t i) const { return graph.block_y[i] / 2; }
};

int root_of(std::vector<int>& parent, int i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
}

template <class Nodes>
std::vector<float> strongest(const Nodes& nodes) {
    std::vector<float> most(nodes.size(), 0.0F);
    for_blocks(0, nodes.size(), [&](std::size_t first, std::size_t last) {
        for (std::size_t i = first; i < last; ++i)
            nodes.neighbours(i, [&](std::size_t, float weight) { most[i] = std::max(most[i], weight); });
    });
    return most;
}

/// Numbers the patches in the order of their first nodes; nodes without any difference belong to none.
template <class Nodes>
std::vector<int> patches_of(const Nodes& nodes, CoarseGraph& coarse) {
    const std::vector<float> most = strongest(nodes);
    std::vector<int> parent(nodes.size());
    std::iota(parent.begin(), parent.end(), 0);
    for (std::size_t i = 0; i < nodes.size(); ++i)
        nodes.neighbours(i, [&](std::size_t j, float weight) {
            if (j < i || weight < weak * std::min(most[i], most[j])) return;
            if (nodes.block_x(i) != nodes.block_x(j) || nodes.block_y(i) != nodes.block_y(j)) return;
            const int a = root_of(parent, static_cast<int>(i)), b = root_of(parent, static_cast<int>(j));
            parent[std::max(a, b)] = std::min(a, b);  // so that a root is its patch's first node
        });
    std::vector<int> patch(nodes.size(), -1);
    for (std::size_t i = 0; i < nodes.size(); ++i) {
        if (most[i] <= 0) continue;
        const auto root = static_cast<std::size_t>(root_of(parent, static_cast<int>(i)));
        if (root == i) {
            patch[i] = static_cast<int>(coarse.block_x.size());
            coarse.block_x.push_back(nodes.block_x(i));
            coarse.block_y.push_back(nodes.block_y(i));
        } else {
            patch[i] = patch[root];
        }
    }
    return patch;
}

/// The finer nodes in the order of their patches: those of patch p stand at order[start[p]]...
struct Members {
    Members(const std::vector<int>& patch, std::size_t patches) : start(patches + 1, 0) {
        for (const int p : patch)
            if (p >= 0) ++start[static_cast<std::size_t>(p) + 1];
        std::partial_sum(start.begin(), start.end(), start.begin());
        order.resize(static_cast<std::size_t>(start.back()));
        std::vector<int> next(start.begin(), start.end() - 1);
        for (std::size_t i = 0; i < patch.size(); ++i)
            if (patch[i] >= 0)
                order[static_cast<std::size_t>(next[static_cast<std::size_t>(patch[i])]++)] = static_cast<int>(i);
    }
    std::vector<int> start, order;
};

/// The weight between two patches is the sum of those between their nodes.
template <class Nodes>
void connect(const Nodes& nodes, const std::vector<int>& patch, CoarseGraph& coarse) {
    const Members members(patch, coarse.nodes());
    coarse.start.push_back(0);
    std::vector<std::pair<int, float>> found;
    for (std::size_t p = 0; p < coarse.nodes(); ++p) {
        found.clear();
        float total = 0;
        for (int m = members.start[p]; m < members.start[p + 1]; ++m)
            nodes.neighbours(static_cast<std::size_t>(members.order[m]), [&](std::size_t j, float weight) {
                const int other = patch[j];
                if (other == static_cast<int>(p)) return;
                total += weight;
                const auto known =
                    std::find_if(found.begin(), found.end(), [&](const auto& f) { return f.first == other; });
                if (known == found.end())
                    found.emplace_back(other, weight);
                else
                    known->second += weight;
            });
        for (const auto& [other, weight] : found) {
            coarse.neighbour.push_back(other);
            coarse.weight.push_back(weight);
        }
        coarse.start.push_back(static_cast<int>(coarse.neighbour.size()));
        coarse.inverse_diagonal.push_back(total > 0 ? 1.0F / total : 0.0F);
    }
}

template <class Nodes>
Aggregation aggregation_of(const Nodes& nodes) {
    Aggregation aggregation;
    aggregation.patch = patches_of(nodes, aggregation.graph);
    connect(nodes, aggregation.patch, aggregation.graph);
    return aggregation;
}

}  // namespace

Aggregation aggregate(const PixelGrid& grid, const DifferenceWeights& weights) {
    return aggregation_of(GridNodes{grid, weights});
}

Aggregation aggregate(const CoarseGraph& graph) { return aggregation_of(GraphNodes{graph}); }

}  // namespace darkbox
