#pragma once

#include <array>
#include <cstddef>
#include <cstring>
#include <limits>
#include <opencv2/core.hpp>
#include <vector>

namespace darkbox {

/// Cluster centres in blocks of eight with the dimension outermost, so that one walk along a point measures its
/// distance to eight centres in vector registers. Differences are squared directly: the shortcut by dot products loses
/// the zero between equal points, by which duplicates are told. Immutable, thus thread-safe.
class CentreBlocks {
public:
    static constexpr int lanes = 8;
    using Distances = std::array<float, lanes>;  ///< squared; lanes beyond the last centre hold no meaning

    struct Nearest {
        int centre = 0;
        float squared_distance = std::numeric_limits<float>::infinity();
    };

    /// One centre in each row.
    explicit CentreBlocks(const cv::Mat1f& centres)
        : count_(centres.rows),
          dimensions_(centres.cols),
          values_(static_cast<std::size_t>((count_ + lanes - 1) / lanes) * dimensions_ * lanes, 0.0F) {
        for (int c = 0; c < count_; ++c)
            for (int d = 0; d < dimensions_; ++d)
                values_[(static_cast<std::size_t>(c / lanes) * dimensions_ + d) * lanes + c % lanes] = centres(c, d);
    }

    Distances distances(const float* point, int block) const {
        Four low{};
        Four high{};
        const float* centre = &values_[static_cast<std::size_t>(block) * dimensions_ * lanes];
        for (int d = 0; d < dimensions_; ++d, centre += lanes) {
            const Four low_difference = point[d] - four_at(centre);
            const Four high_difference = point[d] - four_at(centre + 4);
            low += low_difference * low_difference;
            high += high_difference * high_difference;
        }
        Distances sum;
        std::memcpy(sum.data(), &low, sizeof low);
        std::memcpy(sum.data() + 4, &high, sizeof high);
        return sum;
    }

    /// The first of the nearest centres.
    Nearest nearest(const float* point) const {
        Nearest best;
        for (int first = 0; first < count_; first += lanes) {
            const Distances measured = distances(point, first / lanes);
            for (int lane = 0; lane < lanes && first + lane < count_; ++lane)
                if (measured[lane] < best.squared_distance) best = {first + lane, measured[lane]};
        }
        return best;
    }

private:
    /// The vector type that GCC and Clang share: left to themselves they vectorise along the dimensions instead.
    using Four [[gnu::vector_size(16)]] = float;

    static Four four_at(const float* values) {
        Four four;
        std::memcpy(&four, values, sizeof four);
        return four;
    }

    int count_;
    int dimensions_;
    std::vector<float> values_;  ///< [block][dimension][lane]
};

}  // namespace darkbox
