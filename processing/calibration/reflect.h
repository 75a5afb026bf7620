#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <optional>

#include "processing/calibration/calibration.h"
#include "processing/maps/view.h"

namespace darkbox {

// Where a mirror ball shows a light, and which light a place on it shows: view ray, ray-sphere intersection, mirror
// reflection there. An orthographic camera is the limit of an infinite distance. Viewer frame, millimetres; where no
// scale is known, a view of 1 mm per pixel makes millimetres pixels.

/// Where the ball mirrors the light, and from where it comes.
struct Reflection {
    Eigen::Vector3d point_mm{0, 0, 0};   ///< on the ball
    Eigen::Vector3d direction{0, 0, 1};  ///< unit vector from there to the light
};

/// The light seen mirrored at a pixel; no value where the view ray misses the ball.
std::optional<Reflection> reflect_at(const ViewGeometry& view, const MirrorSphere& sphere, const cv::Point2d& pixel);

/// Pixel where the mirror image of a distant light is seen: the inverse of reflect_at(). No value where the light
/// comes from straight behind the ball, which is never seen.
std::optional<cv::Point2d> highlight_of(const ViewGeometry& view, const MirrorSphere& sphere,
                                        const Eigen::Vector3d& direction);
/// The same for a lamp that stands at a point. No value where it lies in the ball or straight behind it.
std::optional<cv::Point2d> highlight_of_lamp(const ViewGeometry& view, const MirrorSphere& sphere,
                                             const Eigen::Vector3d& position_mm);

/// The same for the circle that an orthographic camera sees; pixels are the unit.
std::optional<cv::Point2d> highlight_of(const Ball& ball, const Eigen::Vector3d& light);

/// The outline of a sphere: its radius is the mean of an ellipse's half axes (geometric).
Ball outline_of(const ViewGeometry& view, const MirrorSphere& sphere, double confidence = 1);

/// The sphere with this outline. An orthographic camera does not tell its depth, which is taken as 0, nor a perspective
/// one its size, so that the same holds there unless `radius_mm` is given: then the depth follows.
MirrorSphere sphere_of(const ViewGeometry& view, const Ball& ball, const std::optional<double>& radius_mm = {});

/// The point nearest to these rays (least squares over the distances). No value where they are parallel, or where it
/// lies behind one of them.
std::optional<Eigen::Vector3d> meeting_point(const std::vector<Reflection>& rays);

}  // namespace darkbox
