#pragma once

#include <array>
#include <opencv2/core.hpp>

#include "processing/transfer/appearance.h"

namespace darkbox {

/// What a texture looks like where the surface faces a given way, learned from a source: a table over (n_x, n_y) of
/// normals that face the viewer, each cell the mean over source pixels weighted by a Gaussian of about 1.4 degrees (at
/// the centre). A source that shows a normal many times, or in many places, counts all of them; on a sphere it is what
/// a blur of its picture gives, looked up where the sphere has the normal. Immutable after construction, thus
/// thread-safe.
class ExpectedLook {
public:
    explicit ExpectedLook(const Appearance& source);

    /// Whether the source has normals near this one.
    bool knows(const cv::Vec3f& normal) const;
    /// Mean colour, 0...255 as displayed; where the source knows nothing, 0.
    cv::Vec3f colour(const cv::Vec3f& normal) const;
    /// Mean squared Laplacian of the picture over the channels: how sharp the texture is there.
    float sharpness(const cv::Vec3f& normal) const;

    /// For each source pixel, how often its like is expected on a target of these normals: sums to the number of valid
    /// target pixels the source knows, but for the table's rounding.
    cv::Mat1f expected_use(const Appearance& source, const NormalMap& target) const;

private:
    cv::Mat1f weight_;  ///< source pixels behind each cell
    cv::Mat3f colour_;
    cv::Mat1f sharpness_weight_;
    cv::Mat1f sharpness_;
};

/// Squared second derivatives, averaged over the channels.
cv::Mat1f squared_laplacian(const cv::Mat3b& picture);

}  // namespace darkbox
