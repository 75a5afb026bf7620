#pragma once

#include <array>
#include <cstddef>
#include <cstring>
#include <opencv2/core.hpp>
#include <vector>

namespace darkbox {

/// Eight points with the dimension outermost, so that one walk along another point measures its distance to all of them
/// in vector registers. Differences are squared directly: the shortcut by dot products loses the zero between equal
/// points, by which duplicates are told. Immutable, thus thread-safe.
class Candidates {
public:
    static constexpr int lanes = 8;
    using Distances = std::array<float, lanes>;  ///< squared

    /// One point in each of eight rows.
    explicit Candidates(const cv::Mat1f& points)
        : dimensions_(points.cols), values_(static_cast<std::size_t>(dimensions_) * lanes) {
        for (int c = 0; c < lanes; ++c)
            for (int d = 0; d < dimensions_; ++d) values_[static_cast<std::size_t>(d) * lanes + c] = points(c, d);
    }

    Distances distances(const float* point) const {
        Four low{};
        Four high{};
        const float* candidate = values_.data();
        for (int d = 0; d < dimensions_; ++d, candidate += lanes) {
            const Four low_difference = point[d] - four_at(candidate);
            const Four high_difference = point[d] - four_at(candidate + 4);
            low += low_difference * low_difference;
            high += high_difference * high_difference;
        }
        Distances sum;
        std::memcpy(sum.data(), &low, sizeof low);
        std::memcpy(sum.data() + 4, &high, sizeof high);
        return sum;
    }

private:
    /// The vector type that GCC and Clang share: left to themselves they vectorise along the dimensions instead.
    using Four [[gnu::vector_size(16)]] = float;

    static Four four_at(const float* values) {
        Four four;
        std::memcpy(&four, values, sizeof four);
        return four;
    }

    int dimensions_;
    std::vector<float> values_;  ///< [dimension][lane]
};

}  // namespace darkbox
