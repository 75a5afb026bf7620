#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "acquisition/frame/progress.h"
#include "acquisition/session/session.h"
#include "processing/calibration/ball_photographs.h"

namespace darkbox {

/// A session's frames of the ball: those of kind ball where there are any, else the lit frames. They are read anew for
/// everything that is asked for, and few rows of them are in memory at a time. Refers to the session.
class SessionBall : public BallPhotographs {
public:
    /// Throws InputError for no lit frame, another number of ball frames, files that cannot be read, sizes that differ.
    SessionBall(const Session& session, WorkContext work);

    cv::Size size() const override { return size_; }
    std::size_t count() const override { return frames_.size(); }
    /// To reduce pictures each is needed whole: as many are held at a time as pictures_at_once() says.
    BallOverview overview(int reduced_side) override;
    std::vector<std::vector<cv::Mat3f>> parts(const std::vector<cv::Rect>& boxes) override;

    bool separate() const { return separate_; }  ///< a capture of its own; else the ball is in view beside the object
    const std::vector<std::string>& files() const {
        return files_;
    }  ///< the lit frames' basenames: their lights' names

    /// Found while parts() were read: each channel's greatest value over the frames, and the greatest luminance.
    const cv::Mat3f& brightest() const { return brightest_; }
    const cv::Mat1f& brightest_luminance() const { return brightest_luminance_; }

    /// Spent on reading so far.
    double seconds() const { return seconds_; }

private:
    const Session& session_;
    WorkContext work_;
    std::vector<FrameRecord> frames_;
    std::vector<std::string> files_;
    bool separate_ = false;
    cv::Size size_;
    double seconds_ = 0;
    cv::Mat3f brightest_;
    cv::Mat1f brightest_luminance_;
};

}  // namespace darkbox
