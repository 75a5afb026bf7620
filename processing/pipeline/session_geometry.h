#pragma once

#include "acquisition/session/session.h"
#include "processing/calibration/calibration.h"
#include "processing/calibration/drift.h"
#include "processing/normals/light_field.h"
#include "processing/pipeline/session_files.h"

namespace darkbox {

/// What the session knows of camera, ball and lamps joins the options, wherever these leave it open: the view, the
/// ball's diameter, and each lit frame's nominal lamp. Near lamps are only thought of where the session does not say
/// that their light is parallel. `size` is of the frames that show the ball.
CalibrationOptions with_geometry(const Session& session, CalibrationOptions options, cv::Size size);

/// Where the rig's description has the lamps, as directions from the rig frame's origin at the object; for warnings.
/// No value where the session does not know it.
std::optional<RigLights> described_lights(const Session& session);

/// What the session tells of camera and lamps but the calibration could not use, in words, with what would let it.
std::vector<std::string> unused_geometry(const Session& session, const CalibrationOptions& options);

/// Where the surface lies: as the session's results have it; where there are none, in the plane of the object. The
/// session must be calibrated.
SceneGeometry scene_geometry(const ResultFiles& files);

/// Where the object's mask, if the session has one, has its centroid.
std::optional<cv::Point2d> object_centroid(const Session& session);
std::optional<cv::Point2d> centroid_of(const cv::Mat1b& mask);

}  // namespace darkbox
