#pragma once

#include <cstddef>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "processing/calibration/calibration.h"
#include "processing/calibration/outline.h"

namespace darkbox {

/// What a ball is searched for in, in place of the frames themselves.
struct BallOverview {
    cv::Mat1f mean;         ///< mean_over_frames()
    ReducedFrames reduced;  ///< without images where they were not asked for
};

/// Frames of the ball: linear radiance, R, G, B, one per lamp, all of one size. They need not be in memory together:
/// what is asked for is all that calibrate() sees of them. Thread-compatible.
class BallPhotographs {
public:
    virtual ~BallPhotographs() = default;
    virtual cv::Size size() const = 0;
    virtual std::size_t count() const = 0;
    /// With pictures reduced to `reduced_side`; 0: without.
    virtual BallOverview overview(int reduced_side) = 0;
    /// These parts of every frame: [box][frame].
    virtual std::vector<std::vector<cv::Mat3f>> parts(const std::vector<cv::Rect>& boxes) = 0;
};

/// Refers to frames that are in memory.
class BallFramesInMemory : public BallPhotographs {
public:
    explicit BallFramesInMemory(const std::vector<cv::Mat3f>& frames) : frames_(frames) {}

    cv::Size size() const override { return frames_.front().size(); }
    std::size_t count() const override { return frames_.size(); }
    BallOverview overview(int reduced_side) override;
    std::vector<std::vector<cv::Mat3f>> parts(const std::vector<cv::Rect>& boxes) override;

private:
    const std::vector<cv::Mat3f>& frames_;
};

/// calibrate() of frames that need not be in memory together.
Calibration calibrate(BallPhotographs& photographs, const std::vector<std::string>& files,
                      const CalibrationOptions& options = {});

}  // namespace darkbox
