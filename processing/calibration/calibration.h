#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "processing/maps/lights.h"
#include "processing/maps/view.h"

namespace darkbox {

/// The outline of a mirror ball in the picture, in pixels (u right, v down, pixel centres at integers).
struct Ball {
    double x = 0;
    double y = 0;
    double radius = 0;
    double confidence = 0;  ///< share of the outline that edges support, 0...1; 1 when given by hand
};

/// One lamp's mirror image on the ball, in pixels.
struct Highlight {
    double u = 0;
    double v = 0;
    double sigma_px = 0.5;  ///< standard deviation of the centroid per axis
    bool clipped = false;   ///< the plateau reached full scale
};

enum class CalibrationMethod {
    refined,    ///< contour, highlights and directions together (Ceres)
    brightest,  ///< the thesis: brightest spot, circle as found
};

struct CalibrationOptions {
    CalibrationMethod method = CalibrationMethod::refined;
    std::optional<Ball> ball;                                     ///< overrides the search
    std::optional<cv::Mat1b> ball_mask;                           ///< overrides the search: 255 on the ball
    std::vector<std::pair<std::string, cv::Point2d>> highlights;  ///< readings by hand: frame file, pixel
    std::vector<std::string> drop;                                ///< frame files to leave out

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

/// Light directions read off a mirror ball.
struct Calibration {
    Lights lights;  ///< one per frame, in the frames' order
    std::vector<Ball> balls;
    std::vector<std::optional<Highlight>> highlights;  ///< one per frame
    std::optional<ViewGeometry> view;                  ///< where millimetres are known
    IntensityOrigin intensity_origin = IntensityOrigin::unknown;
    double condition_number = 0;
    double contour_rms_px = 0;
    std::string method;
    std::vector<std::string> warnings;
    std::vector<std::string> rejected;  ///< observations left out, in words
};

/// Ball frames: linear radiance, R, G, B, one per lamp, all of one size, in the order of `files`.
/// Viewing direction (0, 0, 1), orthographic. Throws InputError: no ball found, fewer than one usable highlight.
/// Source: thesis, light calibration: L = 2 (N.V) N - V.
Calibration calibrate(const std::vector<cv::Mat3f>& frames, const std::vector<std::string>& files,
                      const CalibrationOptions& options = {});

/// Direction to the light whose mirror image is seen at (u, v): L = 2 (N.V) N - V with V = (0, 0, 1).
/// No value outside the ball.
std::optional<Eigen::Vector3d> reflect_at(const Ball& ball, double u, double v);

}  // namespace darkbox
