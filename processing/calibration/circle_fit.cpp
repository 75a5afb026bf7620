#include "processing/calibration/circle_fit.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace darkbox {

double Circle::distance(const cv::Point2d& p) const { return std::hypot(p.x - x, p.y - y) - radius; }

std::optional<Circle> fit_circle_algebraic(const std::vector<cv::Point2d>& points) {
    if (points.size() < 3) return std::nullopt;
    cv::Point2d centre(0, 0);
    for (const auto& p : points) centre += p;
    centre *= 1.0 / static_cast<double>(points.size());

    Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
    Eigen::Vector3d rhs = Eigen::Vector3d::Zero();
    for (const auto& p : points) {
        const Eigen::Vector3d row(p.x - centre.x, p.y - centre.y, 1);
        moments += row * row.transpose();
        rhs += row * row.head<2>().squaredNorm();
    }
    const Eigen::FullPivLU<Eigen::Matrix3d> lu(moments);
    if (!lu.isInvertible()) return std::nullopt;
    const Eigen::Vector3d s = lu.solve(rhs);
    const double square = s[2] + (s[0] * s[0] + s[1] * s[1]) / 4;
    if (!(square > 0)) return std::nullopt;
    return Circle{centre.x + s[0] / 2, centre.y + s[1] / 2, std::sqrt(square)};
}

Circle fit_circle_robust(const std::vector<cv::Point2d>& points, const Circle& start, double scale) {
    constexpr int max_steps = 50;
    Circle circle = start;
    for (int step = 0; step < max_steps; ++step) {
        Eigen::Matrix3d hessian = Eigen::Matrix3d::Zero();
        Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
        for (const auto& p : points) {
            const double dx = p.x - circle.x, dy = p.y - circle.y, length = std::hypot(dx, dy);
            if (!(length > 0)) continue;
            const double error = length - circle.radius;
            const double weight = 1 / (1 + error * error / (scale * scale));
            const Eigen::Vector3d slope(-dx / length, -dy / length, -1);
            hessian += weight * slope * slope.transpose();
            gradient += weight * error * slope;
        }
        const Eigen::FullPivLU<Eigen::Matrix3d> lu(hessian);
        if (points.size() < 3 || !lu.isInvertible()) return start;
        const Eigen::Vector3d move = -lu.solve(gradient);
        circle.x += move[0];
        circle.y += move[1];
        circle.radius += move[2];
        if (!(circle.radius > 0)) return start;
        if (move.norm() < 1e-7) break;
    }
    return circle;
}

double robust_spread(const std::vector<cv::Point2d>& points, const Circle& circle) {
    if (points.empty()) return 0;
    std::vector<double> distances;
    distances.reserve(points.size());
    for (const auto& p : points) distances.push_back(std::abs(circle.distance(p)));
    const auto middle = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2);
    std::nth_element(distances.begin(), middle, distances.end());
    return 1.4826 * *middle;
}

}  // namespace darkbox
