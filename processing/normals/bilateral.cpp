#include "processing/normals/bilateral.h"

#include <algorithm>
#include <cmath>

namespace darkbox {
namespace {

using Floats = std::vector<float>;
using Heights = std::vector<double>;

constexpr float least_share = 1e-3F;     // of a side that was let go: what is left says how far apart the sides are
constexpr double normal_scale = 1.4826;  // of the median absolute deviation

/// Rise less difference, between a and its neighbour b to the right or below.
double misfit(const Slopes& s, const Floats& slope, const Heights& z, std::size_t a, std::size_t b) {
    const float rise = (s.confidence[a] * slope[a] + s.confidence[b] * slope[b]) / (s.confidence[a] + s.confidence[b]);
    return static_cast<double>(rise) - (z[b] - z[a]);
}

float squared_misfit(const Slopes& slopes, const Floats& slope, const Heights& z, std::size_t a, std::size_t b) {
    if (!slopes.valid(a) || !slopes.valid(b)) return 0.0F;
    const auto off = static_cast<float>(misfit(slopes, slope, z, a, b));
    return std::min(slopes.facing(a), slopes.facing(b)) * off * off;
}

float share_of(float ahead, float behind, float sharpness) {
    const float share = 1.0F / (1.0F + std::exp(std::clamp(sharpness * (ahead - behind), -60.0F, 60.0F)));
    return std::clamp(share, least_share, 1.0F - least_share);
}

struct Edge {
    float weight = 0, pull = 0;
    double energy = 0;
};

Edge edge_between(const Slopes& s, const Floats& slope, const Floats& share, const Heights& z, double sharpness,
                  std::size_t a, std::size_t b) {
    if (!s.valid(a) || !s.valid(b)) return {};
    const float of_a = s.facing(a), of_b = s.facing(b);
    const double off = misfit(s, slope, z, a, b);
    const double held = s.confidence[a] * of_a * share[a] + s.confidence[b] * of_b * (1.0F - share[b]);
    const double weight = held / (1 + sharpness * static_cast<double>(std::min(of_a, of_b)) * off * off);
    return {static_cast<float>(weight), static_cast<float>(weight * off), weight * off * off};
}

}  // namespace

BilateralEdges::BilateralEdges(const PixelGrid& grid)
    : weights{Floats(grid.size(), 0.0F), Floats(grid.size(), 0.0F)},
      pull_right(grid.size(), 0.0F),
      pull_down(grid.size(), 0.0F) {}

void update_shares(const Slopes& slopes, const Heights& heights, double sharpness, Shares& shares) {
    const std::size_t stride = slopes.grid.stride();
    const auto k = static_cast<float>(sharpness);
    for_blocks(slopes.grid.begin(), slopes.grid.end(), [&](std::size_t first, std::size_t last) {
        for (std::size_t i = first; i < last; ++i) {
            if (!slopes.valid(i)) continue;
            shares.right[i] = share_of(squared_misfit(slopes, slopes.right, heights, i, i + 1),
                                       squared_misfit(slopes, slopes.right, heights, i - 1, i), k);
            shares.down[i] = share_of(squared_misfit(slopes, slopes.down, heights, i, i + stride),
                                      squared_misfit(slopes, slopes.down, heights, i - stride, i), k);
        }
    });
}

void update_edges(const Slopes& slopes, const Shares& shares, const Heights& heights, double sharpness,
                  BilateralEdges& edges) {
    const std::size_t stride = slopes.grid.stride();
    edges.energy = sum_of_blocks(slopes.grid.begin(), slopes.grid.end(), [&](std::size_t first, std::size_t last) {
        double energy = 0;
        for (std::size_t i = first; i < last; ++i) {
            const Edge right = edge_between(slopes, slopes.right, shares.right, heights, sharpness, i, i + 1);
            const Edge down = edge_between(slopes, slopes.down, shares.down, heights, sharpness, i, i + stride);
            edges.weights.right[i] = right.weight;
            edges.weights.down[i] = down.weight;
            edges.pull_right[i] = right.pull;
            edges.pull_down[i] = down.pull;
            energy += right.energy + down.energy;
        }
        return energy;
    });
}

double misfit_scale(const Slopes& slopes, const Heights& heights) {
    Floats misfits;
    for (std::size_t i = slopes.grid.begin(); i < slopes.grid.end(); ++i)
        if (slopes.valid(i) && slopes.valid(i + 1))
            misfits.push_back(squared_misfit(slopes, slopes.right, heights, i, i + 1));
    if (misfits.empty()) return 0;
    const auto middle = misfits.begin() + static_cast<std::ptrdiff_t>(misfits.size() / 2);
    std::nth_element(misfits.begin(), middle, misfits.end());
    return normal_scale * std::sqrt(static_cast<double>(*middle));
}

std::vector<unsigned char> cuts_of(const Slopes& slopes, const BilateralEdges& edges, double share) {
    std::vector<unsigned char> cuts(slopes.grid.size(), 0);
    const auto is_cut = [&](std::size_t a, std::size_t b, float weight) {
        if (!slopes.valid(a) || !slopes.valid(b)) return false;
        const float smooth = (slopes.confidence[a] * slopes.facing(a) + slopes.confidence[b] * slopes.facing(b)) / 2;
        return static_cast<double>(weight) < share * static_cast<double>(smooth);
    };
    for (std::size_t i = slopes.grid.begin(); i < slopes.grid.end(); ++i) {
        if (is_cut(i, i + 1, edges.weights.right[i])) cuts[i] |= cut_right;
        if (is_cut(i, i + slopes.grid.stride(), edges.weights.down[i])) cuts[i] |= cut_down;
    }
    return cuts;
}

}  // namespace darkbox
