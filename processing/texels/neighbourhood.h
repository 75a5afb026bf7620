#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "processing/maps/maps.h"
#include "processing/texels/points.h"

namespace darkbox {

/// One point for each of `pixels` (all valid): the RGB of every pixel in the window x window square about it, in
/// reading order. A neighbour that is not valid or outside the image counts as the centre pixel itself, so nothing from
/// beyond the mask gets in. Thesis, texel clustering. Reads the map, which must outlive it, each time.
class Neighbourhoods : public PointSource {
public:
    Neighbourhoods(const AlbedoMap& albedo, std::vector<cv::Point> pixels, int window);

    int count() const override { return static_cast<int>(pixels_.size()); }
    int dimensions() const override { return window_ * window_ * 3; }
    void read(std::span<const int> points, float* to) const override;

private:
    const AlbedoMap& albedo_;
    std::vector<cv::Point> pixels_;
    std::vector<bool> whole_;  ///< every neighbour is valid
    int window_;
};

}  // namespace darkbox
