#pragma once

#include <memory>
#include <opencv2/core.hpp>
#include <vector>

#include "acquisition/session/session.h"
#include "processing/pipeline/frame_rows.h"

namespace darkbox {

/// The frames without a lamp that belong to lit ones: of the same exposure and gain, and of the same run of the rig.
/// Where the room's light was not kept out these are the ambient frames, and each lit frame is told the light between
/// the one before it and the one after it, by its time; else the dark frames, whose mean serves all. Read row by row
/// with the lit frames. Thread-compatible.
class UnlitFrames {
public:
    /// For those of the `served` lit frames that are like `lit`, which is one of them: of ambient frames only what lies
    /// around them in time is read.
    UnlitFrames(const Session& session, const FrameRecord& lit, const std::vector<FrameRecord>& served);

    bool fits(const FrameRecord& lit) const;
    bool empty() const { return frames_.empty(); }
    /// How many frames the answer of level_for() is made of.
    int count() const { return ambient_ ? 1 : static_cast<int>(frames_.size()); }
    std::size_t bytes_per_pixel() const { return sizeof(cv::Vec3f) * (ambient_ ? frames_.size() + 1 : 1); }

    /// The next rows of all of them.
    void read_next(int rows, cv::Size size);
    /// What stood in those rows without the lamp, in sample units. Const calls may come from several threads.
    cv::Mat3f level_for(const FrameRecord& lit) const;

private:
    void keep_around(const std::vector<FrameRecord>& served);

    FrameRecord like_;
    bool ambient_ = false;
    std::vector<FrameRecord> records_;  ///< in order of time
    std::vector<std::unique_ptr<FrameRows>> frames_;
    cv::Mat3f mean_;               ///< of dark frames
    std::vector<cv::Mat3f> rows_;  ///< of every ambient frame
};

}  // namespace darkbox
