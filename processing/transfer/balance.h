#pragma once

#include <array>
#include <opencv2/core.hpp>
#include <vector>

#include "processing/transfer/normal_table.h"
#include "processing/transfer/pyramid.h"
#include "processing/transfer/texel_bytes.h"

namespace darkbox {

/// How strongly the balance pulls, in squared byte differences of a 5 x 5 patch.
struct BalanceOptions {
    float usage = 6000;       ///< for a source texel that is used as often as it should be
    float most_usage = 8;     ///< times that: no more is added for what is used still more often
    float histogram = 1250;   ///< per byte step of the distance between the histograms
    float colour = 1;         ///< per squared byte of the difference of the smooth colours
    double smooth_sigma = 6;  ///< what counts as smooth, pixels of the finest level
};

/// Keeps a synthesised texture as rich as its source. The normals alone tell what is expected: a source texel is
/// wanted as often as the target has its normal, relative to the source (an occurrence limit, Kaspar et al. 2015,
/// section 4.2, that allows for the guide). From that follow the colour histograms of the whole and the smooth colour
/// at each place. What the texture has too much of costs more: texels by how often they are used, colours by the
/// gradient of the Cramer distance between the histograms, and at each place by the difference of the smooth colours.
class TextureBalance {
public:
    /// `level` tells how many times the maps were halved.
    TextureBalance(const MapLevel& source, const TexelBytes& source_bytes, const MapLevel& target,
                   const NormalTable& table, int level, const BalanceOptions& options);

    /// Takes the texture as it is now into account. Costs are means over all that was observed: all pixels answer to
    /// them at once, and would swing from one extreme to the other with each pass.
    /// `places` are the source's at the target's places.
    void observe(const std::vector<int>& places, const TexelBytes& target_bytes);

    /// What using the texel at a source place costs more.
    float cost(int place) const { return cost_[static_cast<std::size_t>(place)]; }

    /// What a byte of R, G and B costs more at a target pixel.
    const cv::Vec3f& pull(int x, int y) const { return pull_(y >> cell_shift_, x >> cell_shift_); }

private:
    using Histogram = std::array<double, 256>;
    using Potential = std::array<float, 256>;

    const MapLevel& source_;
    const TexelBytes& source_bytes_;
    const MapLevel& target_;
    BalanceOptions options_;
    int cell_shift_;     ///< smooth colours are kept for cells of 2^shift pixels
    double cell_sigma_;  ///< in cells
    cv::Mat1f expected_uses_;
    std::array<Histogram, 3> expected_histograms_;
    cv::Mat3f expected_colour_;  ///< smooth, of each cell
    cv::Mat1f usage_cost_;
    std::array<Potential, 3> potential_{};
    std::vector<float> cost_;  ///< at the source's places
    cv::Mat3f pull_;
    int observations_ = 0;

    cv::Mat3f smooth_cells(const cv::Mat3f& sums, const cv::Mat1f& counts) const;
    void expect_uses(const NormalTable& table);
    void expect_histograms();
    void expect_colour(const NormalTable& table);
    void observe_usage(const std::vector<int>& places, const TexelBytes& target_bytes, float share);
    void observe_histograms(const TexelBytes& target_bytes, float share);
    void observe_colour(const TexelBytes& target_bytes);
};

}  // namespace darkbox
