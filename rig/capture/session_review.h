#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "acquisition/session/session_writer.h"

namespace darkbox {

/// The object of a session that shows the mirror ball alone: what it tells becomes the reference.
inline constexpr const char* recalibration_object = "recalibration";

/// What somebody found who saw all frames of a session.
struct SessionReview {
    std::vector<std::string> findings;  ///< sentences, each with its remedy
    std::vector<FrameDoubt> doubts;     ///< frames that are not verified after all
};

/// Looks at a session whose frames are all there and which is not sealed yet. What it throws fails the capture; the
/// session can then be resumed.
using ReviewSession = std::function<SessionReview(const SessionWriter& session)>;

}  // namespace darkbox
