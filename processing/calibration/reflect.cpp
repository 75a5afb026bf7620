#include "processing/calibration/reflect.h"

#include <cmath>

namespace darkbox {

std::optional<Eigen::Vector3d> reflect_at(const Ball& ball, double u, double v) {
    const double x = (u - ball.x) / ball.radius;
    const double y = -(v - ball.y) / ball.radius;  // v runs down, y up
    const double zz = 1 - x * x - y * y;
    if (!(zz >= 0)) return std::nullopt;
    const Eigen::Vector3d view(0, 0, 1);
    const Eigen::Vector3d normal(x, y, std::sqrt(zz));
    return Eigen::Vector3d(2 * normal.dot(view) * normal - view).normalized();
}

std::optional<cv::Point2d> highlight_of(const Ball& ball, const Eigen::Vector3d& light) {
    const Eigen::Vector3d halfway = light.normalized() + Eigen::Vector3d(0, 0, 1);
    if (!(halfway.norm() > 1e-9)) return std::nullopt;
    const Eigen::Vector3d normal = halfway.normalized();
    return cv::Point2d(ball.x + ball.radius * normal.x(), ball.y - ball.radius * normal.y());
}

}  // namespace darkbox
