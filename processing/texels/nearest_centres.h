#pragma once

#include <cstddef>
#include <opencv2/core.hpp>
#include <vector>

namespace darkbox {

/// What the kernel of NearestCentres reads.
struct CentreTable {
    const float* values;  ///< [block][dimension][lane]
    const float* bias;    ///< |c|^2 / 2, [block][lane]; the greatest float where there is no centre
    int blocks;
    int dimensions;
};

/// Finds the nearest of many centres for points by |c|^2 / 2 - p.c, which costs one multiplication and addition a
/// coordinate and differs from half the squared distance by |p|^2 / 2 alone. It rounds to about 1e-7 of |p| |c|: give
/// points and centres about their common mean. A tie goes to the first centre. Centres and points pass through vector
/// registers (Highway), each sum in one order whatever their width. Immutable, thus thread-safe.
class NearestCentres {
public:
    struct Found {
        int centre = 0;
        float score = 0;   ///< |c|^2 / 2 - p.c of that centre
        float second = 0;  ///< the same of the second nearest; the greatest float where there is one centre
    };

    /// One centre in each row, at least one.
    explicit NearestCentres(const cv::Mat1f& centres);

    /// Point i is at points + i * dimensions; found[i] tells of it.
    void find(const float* points, std::size_t count, Found* found) const;

private:
    int width_;  ///< centres in a block
    int blocks_;
    int dimensions_;
    std::vector<float> values_;
    std::vector<float> bias_;
};

}  // namespace darkbox
