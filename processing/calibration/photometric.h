#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <vector>

#include "processing/maps/maps.h"

namespace darkbox {

/// Some of the object's pixels under every lamp: what its diffuse surface says of the lights.
struct ObjectPixels {
    std::vector<cv::Point2d> at;
    Eigen::MatrixXd radiance;  ///< pixels x frames, the channels' mean; negative where clipped or not a number

    bool empty() const { return at.empty(); }
};
/// Pixels on a regular grid over the mask: as many as give about 6000 samples, at least 150. `stack` in the order of
/// the calibration's frames.
ObjectPixels object_pixels(const PhotoStack& stack);

/// The samples that follow Lambert's law, and how well they do.
struct LambertSamples {
    std::vector<cv::Point2d> at;
    Eigen::MatrixXd radiance;            ///< pixels x frames; each pixel's brightest sample is 1
    Eigen::MatrixXd kept;                ///< pixels x frames: 1 where the sample counts, else 0
    Eigen::VectorXd intensity;           ///< of each frame's lamp, where to start from
    double sigma = 1;                    ///< standard deviation of a sample
    double samples_per_independent = 1;  ///< neighbours err alike where the surface is not quite Lambert's

    bool empty() const { return at.empty(); }
    double effective_sigma() const;
    /// Whether a light can be told from what is kept of its frame.
    bool tells(std::size_t frame) const;
};
/// Under distant lights of any directions and intensities a Lambert object's samples are a matrix of rank three:
/// (pixel's albedo times normal) . (light's intensity times direction). It is fitted by alternating least squares,
/// starting from `directions`, and samples in shadow, in a highlight or otherwise off it by more than three standard
/// deviations are left out, and pixels with few left. No light need be right for that. Source: Hayakawa 1994,
/// section 2. `directions`: one per frame, at the object; zero where the frame has none. Empty where too little is
/// left.
LambertSamples lambert_samples(const ObjectPixels& pixels, const std::vector<Eigen::Vector3d>& directions);

}  // namespace darkbox
