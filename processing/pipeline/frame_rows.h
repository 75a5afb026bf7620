#pragma once

#include <memory>
#include <opencv2/core.hpp>

#include "acquisition/session/session.h"

namespace darkbox {

/// One frame of a session, captured or imported, read from the top. Thread-compatible.
class FrameRows {
public:
    virtual ~FrameRows() = default;
    virtual cv::Size size() const = 0;
    /// CV_8UC3, CV_16UC3 or CV_32FC3; grey is replicated, a colour mosaic interpolated.
    virtual int type() const = 0;
    /// The next rows as stored. `samples` is used again where it fits. Throws InputError that names the file.
    virtual void read(int rows, cv::Mat& samples) = 0;
};

bool is_captured(const FrameRecord& frame);

std::unique_ptr<FrameRows> open_frame_rows(const Session& session, const FrameRecord& frame);

}  // namespace darkbox
