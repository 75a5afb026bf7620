#include "processing/calibration/reflect.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "processing/calibration/mirror.h"

namespace darkbox {
namespace {

constexpr double straight_behind = 1e-9;
constexpr double parallel = 1e-8;  ///< of the rays' normal matrix: smallest eigenvalue per ray

template <class ToLamp>
cv::Point2d mirrored_at(const ViewGeometry& geometry, const MirrorSphere& sphere, const ToLamp& to_lamp) {
    const Viewing view(geometry);
    const Eigen::Vector3d normal = mirror_normal<double>(view, sphere.centre_mm, sphere.radius_mm, to_lamp);
    const Eigen::Vector2d at = view.project<double>(sphere.centre_mm + sphere.radius_mm * normal);
    return {at.x(), at.y()};
}

bool behind(const ViewGeometry& view, const MirrorSphere& sphere, const Eigen::Vector3d& to_lamp) {
    return (to_lamp + view.to_camera(sphere.centre_mm)).norm() < straight_behind;
}

}  // namespace

std::optional<Eigen::Vector3d> reflect_at(const Ball& ball, double u, double v) {
    const double x = (u - ball.x) / ball.radius;
    const double y = -(v - ball.y) / ball.radius;  // v runs down, y up
    const double zz = 1 - x * x - y * y;
    if (!(zz >= 0)) return std::nullopt;
    const Eigen::Vector3d view(0, 0, 1);
    const Eigen::Vector3d normal(x, y, std::sqrt(zz));
    return Eigen::Vector3d(2 * normal.dot(view) * normal - view).normalized();
}

std::optional<Reflection> reflect_at(const ViewGeometry& view, const MirrorSphere& sphere, const cv::Point2d& pixel) {
    const Eigen::Vector3d origin = view.point_at(pixel), towards = view.to_camera(origin);
    const Eigen::Vector3d from_centre = origin - sphere.centre_mm;
    const double along = -from_centre.dot(towards);
    const double off_squared = (from_centre + along * towards).squaredNorm();
    const double left = sphere.radius_mm * sphere.radius_mm - off_squared;
    if (!(left >= 0)) return std::nullopt;
    const Eigen::Vector3d point = origin + (along + std::sqrt(left)) * towards;  // the side that faces the camera
    const Eigen::Vector3d normal = (point - sphere.centre_mm) / sphere.radius_mm;
    return Reflection{point, (2 * normal.dot(towards) * normal - towards).normalized()};
}

std::optional<cv::Point2d> highlight_of(const ViewGeometry& view, const MirrorSphere& sphere,
                                        const Eigen::Vector3d& direction) {
    const Eigen::Vector3d light = direction.normalized();
    if (!light.allFinite() || behind(view, sphere, light)) return std::nullopt;
    return mirrored_at(view, sphere, [&](const Eigen::Vector3d&) { return light; });
}

std::optional<cv::Point2d> highlight_of_lamp(const ViewGeometry& view, const MirrorSphere& sphere,
                                             const Eigen::Vector3d& position_mm) {
    const Eigen::Vector3d off = position_mm - sphere.centre_mm;
    if (!(off.norm() > sphere.radius_mm) || behind(view, sphere, off.normalized())) return std::nullopt;
    return mirrored_at(view, sphere, [&](const Eigen::Vector3d& point) {
        return Eigen::Vector3d((position_mm - point).normalized());
    });
}

std::optional<cv::Point2d> highlight_of(const Ball& ball, const Eigen::Vector3d& light) {
    return highlight_of({1.0, {0, 0}}, {{ball.x, -ball.y, 0}, ball.radius}, light);
}

Ball outline_of(const ViewGeometry& geometry, const MirrorSphere& sphere, double confidence) {
    const auto outline = outline_of_sphere<double>(Viewing(geometry), sphere.centre_mm, sphere.radius_mm);
    Ball ball{outline.x, outline.y, std::sqrt(outline.along * outline.across), confidence};
    if (geometry.perspective()) {
        const cv::Point2d out(outline.x - geometry.principal.x, outline.y - geometry.principal.y);
        ball.ellipse = BallEllipse{outline.along, outline.across, std::atan2(out.y, out.x)};
    }
    return ball;
}

MirrorSphere sphere_of(const ViewGeometry& view, const Ball& ball, const std::optional<double>& radius_mm) {
    constexpr int steps = 30;
    const double k = 1 / view.distance_mm;
    const double wanted = ball.radius * view.mm_per_pixel;
    MirrorSphere sphere;
    double across = wanted;  // the short half axis, mm in the plane z = 0; the long one is found on the way
    cv::Point2d centre(ball.x, ball.y);
    for (int step = 0; step < steps; ++step) {
        double w = 1;
        if (radius_mm && view.perspective()) {
            w = std::hypot(*radius_mm / across, k * *radius_mm);
            sphere = {{0, 0, (1 - w) * view.distance_mm}, *radius_mm};
        } else {
            sphere = {{0, 0, 0}, across / std::sqrt(1 + k * k * across * across)};
        }
        const double scale = (w * w - k * k * sphere.radius_mm * sphere.radius_mm) / w * view.mm_per_pixel;
        sphere.centre_mm.x() = (centre.x - view.principal.x) * scale;
        sphere.centre_mm.y() = -(centre.y - view.principal.y) * scale;
        if (!view.perspective()) break;
        across *= ball.radius / outline_of(view, sphere).radius;
    }
    return sphere;
}

std::optional<Eigen::Vector3d> meeting_point(const std::vector<Reflection>& rays) {
    Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    for (const Reflection& ray : rays) {
        const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - ray.direction * ray.direction.transpose();
        sum += across;
        right += across * ray.point_mm;
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(sum);
    if (rays.empty() || !(solver.eigenvalues()[0] > parallel * static_cast<double>(rays.size()))) return std::nullopt;
    const Eigen::Vector3d point =
        solver.eigenvectors() * (solver.eigenvectors().transpose() * right).cwiseQuotient(solver.eigenvalues());
    const bool ahead = std::all_of(
        rays.begin(), rays.end(), [&](const Reflection& ray) { return (point - ray.point_mm).dot(ray.direction) > 0; });
    return ahead ? std::optional(point) : std::nullopt;
}

}  // namespace darkbox
