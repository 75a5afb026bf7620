#pragma once

#include <opencv2/core.hpp>
#include <vector>

namespace darkbox {

/// Mean over frames and channels: the ball stands still while the lamps change, so its outline adds up and noise, cast
/// shadows and single highlights average out.
cv::Mat1f mean_over_frames(const std::vector<cv::Mat3f>& frames);

/// The frames as luminance pictures no longer than `max_side`, and what one of their pixels measures in the frames'.
struct ReducedFrames {
    std::vector<cv::Mat1f> images;
    double scale = 1;  ///< frame pixels per reduced pixel

    double to_frame(double reduced) const { return (reduced + 0.5) * scale - 0.5; }
};
ReducedFrames reduce(const std::vector<cv::Mat3f>& frames, int max_side);

/// How frames of one size are reduced, one luminance picture at a time.
class Reduction {
public:
    Reduction(cv::Size size, int max_side);
    double scale() const { return scale_; }  ///< frame pixels per reduced pixel
    cv::Mat1f of(const cv::Mat1f& luminance) const;

private:
    double scale_;
    cv::Size small_;
};

/// Logarithm above a floor of a few standard deviations of the noise: a dark ball before a dark wall shows as clearly
/// as a bright one.
cv::Mat1f compress(const cv::Mat1f& radiance);

}  // namespace darkbox
