#pragma once

#include "acquisition/session/session.h"
#include "processing/calibration/calibration.h"

namespace darkbox {

/// What the session knows of camera, ball and lamps joins the options, wherever these leave it open: the view, the
/// ball's diameter, and each lit frame's nominal lamp. Near lamps are only thought of where the session does not say
/// that their light is parallel. `size` is of the frames that show the ball.
CalibrationOptions with_geometry(const Session& session, CalibrationOptions options, cv::Size size);

/// Where the object's mask, if the session has one, has its centroid.
std::optional<cv::Point2d> object_centroid(const Session& session);

}  // namespace darkbox
