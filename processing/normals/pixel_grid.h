#pragma once

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <cstddef>
#include <numeric>
#include <vector>

namespace darkbox {

/// A picture's pixels as one array with a border: the neighbours of index i are i + 1, i - 1, i + stride() and
/// i - stride() for every pixel, and the border's entries stay zero.
struct PixelGrid {
    int width = 0;
    int height = 0;

    std::size_t stride() const { return static_cast<std::size_t>(width) + 1; }
    std::size_t size() const { return (static_cast<std::size_t>(height) + 2) * stride(); }
    std::size_t at(int x, int y) const {
        return static_cast<std::size_t>(y + 1) * stride() + static_cast<std::size_t>(x);
    }
    std::size_t begin() const { return stride(); }
    std::size_t end() const { return size() - stride(); }
};

/// Weights of the differences between neighbours: `right[i]` between i and i + 1, `down[i]` between i and i + stride().
/// 0 where there is no such difference.
struct DifferenceWeights {
    std::vector<float> right, down;
};

constexpr std::size_t entries_per_block = 1 << 14;  // a sum's blocks follow from the data alone, not from the threads

template <class Body>
void for_blocks(std::size_t begin, std::size_t end, Body&& body) {
    const std::size_t blocks = (end - begin + entries_per_block - 1) / entries_per_block;
    tbb::parallel_for(std::size_t{0}, blocks, [&](std::size_t block) {
        const std::size_t first = begin + block * entries_per_block;
        body(first, std::min(first + entries_per_block, end));
    });
}

/// Sum over blocks of body(first, last), added up in the blocks' order.
template <class Body>
double sum_of_blocks(std::size_t begin, std::size_t end, Body&& body) {
    std::vector<double> sums((end - begin + entries_per_block - 1) / entries_per_block);
    for_blocks(begin, end, [&](std::size_t first, std::size_t last) {
        sums[(first - begin) / entries_per_block] = body(first, last);
    });
    return std::accumulate(sums.begin(), sums.end(), 0.0);
}

}  // namespace darkbox
