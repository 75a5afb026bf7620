#pragma once

#include <Eigen/Core>
#include <limits>
#include <opencv2/core.hpp>
#include <optional>

namespace darkbox {

/// How the camera's pixels lie in the viewer frame, whose origin is the point on the optical axis at the object's
/// distance. Lens distortion is left out. Pixel centres at integers, u right, v down. Thread-compatible.
struct ViewGeometry {
    double mm_per_pixel = 1.0;                                     ///< in the plane z = 0
    cv::Point2d principal;                                         ///< pixel of the viewer frame's origin
    double distance_mm = std::numeric_limits<double>::infinity();  ///< camera centre to origin; infinite: orthographic

    bool perspective() const { return distance_mm < std::numeric_limits<double>::infinity(); }
    /// The point seen at `pixel` at height z_mm, viewer frame, mm.
    Eigen::Vector3d point_at(const cv::Point2d& pixel, double z_mm = 0) const;
    /// Where a point of the viewer frame (mm) is seen: the inverse of point_at().
    cv::Point2d project(const Eigen::Vector3d& point_mm) const;
    /// Unit vector from a point of the viewer frame (mm) to the camera; (0, 0, 1) when orthographic.
    Eigen::Vector3d to_camera(const Eigen::Vector3d& point_mm) const;
};

/// Where the surface lies: needed for near lamps, and for the direction to a near camera.
struct SceneGeometry {
    std::optional<ViewGeometry> view;  ///< none: unknown, which distant lights can do without
    cv::Mat1f height_mm;  ///< z of each pixel's point, viewer frame; empty, or not finite at a pixel: z = 0. A first
                          ///< solution's integrated height refines near lights in a second one.

    /// What a pixel of the picture shows, viewer frame, mm. `view` must be known.
    Eigen::Vector3d point_at(int row, int column) const;
};

}  // namespace darkbox
