#include "processing/maps/view.h"

#include <cmath>

namespace darkbox {

Eigen::Vector3d ViewGeometry::point_at(const cv::Point2d& pixel, double z_mm) const {
    const double spread = perspective() ? 1 - z_mm / distance_mm : 1;
    const cv::Point2d off = (pixel - principal) * (mm_per_pixel * spread);
    return {off.x, -off.y, z_mm};  // v runs down, y up
}

cv::Point2d ViewGeometry::project(const Eigen::Vector3d& point_mm) const {
    const double spread = perspective() ? 1 - point_mm.z() / distance_mm : 1;
    const double scale = mm_per_pixel * spread;
    return {principal.x + point_mm.x() / scale, principal.y - point_mm.y() / scale};
}

Eigen::Vector3d ViewGeometry::to_camera(const Eigen::Vector3d& point_mm) const {
    if (!perspective()) return {0, 0, 1};
    return (Eigen::Vector3d(0, 0, distance_mm) - point_mm).normalized();
}

Eigen::Vector3d SceneGeometry::point_at(int row, int column) const {
    double z = 0;
    if (!height_mm.empty())
        if (const float known = height_mm(row, column); std::isfinite(known)) z = static_cast<double>(known);
    return view->point_at(cv::Point2d(column, row), z);
}

}  // namespace darkbox
