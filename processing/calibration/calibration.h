#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "processing/calibration/photometric.h"
#include "processing/maps/lights.h"
#include "processing/maps/view.h"

namespace darkbox {

/// The half axes of a ball's outline as a perspective camera sees it, in pixels.
struct BallEllipse {
    double along = 0;      ///< the long one, towards the principal point
    double across = 0;     ///< the short one
    double angle_rad = 0;  ///< of the long one, from u towards v
};

/// The outline of a mirror ball in the picture, in pixels (u right, v down, pixel centres at integers).
struct Ball {
    double x = 0;
    double y = 0;
    double radius = 0;                        ///< of an ellipse: the geometric mean of its half axes
    double confidence = 0;                    ///< share of the outline that edges support, 0...1; 1 when given by hand
    std::optional<BallEllipse> ellipse = {};  ///< from a perspective camera
};

/// A mirror ball in space: viewer frame, mm; pixels where the scale is not known.
struct MirrorSphere {
    Eigen::Vector3d centre_mm{0, 0, 0};
    double radius_mm = 0;
};

/// One lamp's mirror image on the ball, in pixels.
struct Highlight {
    double u = 0;
    double v = 0;
    double sigma_px = 0.5;  ///< standard deviation of the centroid per axis
    bool clipped = false;   ///< the plateau reached full scale
};

enum class CalibrationMethod {
    refined,    ///< contour, highlights and lights together (Ceres)
    brightest,  ///< the thesis: brightest spot, circle as found
};

enum class LampModel {
    automatic,  ///< near where the lamps' distances are known and below ten times the field of view, else distant
    distant,    ///< a direction, the same everywhere
    near,       ///< a position in mm: from two or more balls, or from one and the lamps' nominal places
};

/// Where the rig's description says that the lamps are, and how far to believe it.
struct NominalLamps {
    std::vector<std::optional<Eigen::Vector3d>> position_in_rig_mm;  ///< one per frame
    double slack_mm = 20;       ///< standard deviation of each lamp per axis, as mounted
    double turn_sigma_deg = 5;  ///< of the rig against the viewer frame, per axis
    double shift_sigma_mm = 20;
};

struct CalibrationOptions {
    CalibrationMethod method = CalibrationMethod::refined;
    std::vector<Ball> balls;                                      ///< override the search
    std::optional<cv::Mat1b> ball_mask;                           ///< overrides the search: 255 on the ball or balls
    std::vector<std::pair<std::string, cv::Point2d>> highlights;  ///< readings by hand: frame file, pixel
    std::vector<std::string> drop;                                ///< frame files to leave out

    LampModel lamps = LampModel::automatic;
    std::optional<ViewGeometry> view;        ///< none: orthographic, of unknown scale
    std::optional<double> ball_diameter_mm;  ///< of every ball; gives the scale where `view` is not known
    std::optional<NominalLamps> nominal;     ///< needed for near lamps off a single ball
    std::optional<cv::Point2d> object;       ///< pixel where directions are to hold; none: the picture's centre
    ObjectPixels object_pixels;              ///< refined: these are to follow Lambert's law as well; empty: left out

    /// Throws InputError that names the field and the allowed range.
    void validate() const;
};

/// Where Light::intensity comes from.
enum class IntensityOrigin {
    unknown,    ///< all taken as 1
    given,      ///< came with the photographs
    grey_card,  ///< a diffuse plane in view
    flat,       ///< frames of a diffuse plane in the object's place
    estimated,  ///< together with the normals
};

/// Lights read off one or more mirror balls.
struct Calibration {
    Lights lights;                                                ///< one per frame, in the frames' order
    std::vector<Ball> balls;                                      ///< best first
    std::vector<std::optional<Highlight>> highlights;             ///< one per frame, on the first ball that shows one
    std::vector<std::vector<std::optional<Highlight>>> readings;  ///< [ball][frame]
    std::optional<ViewGeometry> view;                             ///< where millimetres are known
    IntensityOrigin intensity_origin = IntensityOrigin::unknown;
    double condition_number = 0;
    double contour_rms_px = 0;
    std::string method;
    std::vector<std::string> warnings;
    std::vector<std::string> rejected;  ///< observations left out, in words
};

/// Ball frames: linear radiance, R, G, B, one per lamp, all of one size, in the order of `files`. Lights come in the
/// viewer frame; a near light's direction holds at the object, which is where `object` is seen in the plane z = 0.
/// Throws InputError: no ball found, fewer than one usable highlight, near lamps asked for without a scale.
/// Source: thesis, light calibration: L = 2 (N.V) N - V.
Calibration calibrate(const std::vector<cv::Mat3f>& frames, const std::vector<std::string>& files,
                      const CalibrationOptions& options = {});

/// Direction to the light whose mirror image is seen at (u, v): L = 2 (N.V) N - V with V = (0, 0, 1).
/// No value outside the ball. For cameras and balls in space see reflect.h.
std::optional<Eigen::Vector3d> reflect_at(const Ball& ball, double u, double v);

}  // namespace darkbox
