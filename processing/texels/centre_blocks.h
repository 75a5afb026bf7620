#pragma once

#include <array>
#include <cstddef>
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
        Distances sum{};
        const float* centre = &values_[static_cast<std::size_t>(block) * dimensions_ * lanes];
        for (int d = 0; d < dimensions_; ++d, centre += lanes)
            for (int lane = 0; lane < lanes; ++lane) {
                const float difference = point[d] - centre[lane];
                sum[lane] += difference * difference;
            }
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
    int count_;
    int dimensions_;
    std::vector<float> values_;  ///< [block][dimension][lane]
};

}  // namespace darkbox
