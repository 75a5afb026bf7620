#include "processing/maps/lights.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "acquisition/frame/error.h"

namespace darkbox {
namespace {

constexpr double coplanar_condition = 1e3;

}  // namespace

double Light::sigma_deg() const { return std::sqrt(std::max(0.0, covariance.trace()) / 2) * 180 / std::numbers::pi; }

Incidence incidence(const Light& light, const Eigen::Vector3d& point_mm) {
    if (!light.near) return {light.direction, 1.0};
    const Eigen::Vector3d to_lamp = light.near->position_mm - point_mm;
    const double squared = to_lamp.squaredNorm();
    return {to_lamp / std::sqrt(squared), (light.near->position_mm - light.near->object_mm).squaredNorm() / squared};
}

Light held_at(Light light, const Eigen::Vector3d& object_mm) {
    if (!light.near) return light;
    const Incidence there = incidence(light, object_mm);
    const double distance = (light.near->position_mm - object_mm).norm();
    const Eigen::Matrix3d across =
        (Eigen::Matrix3d::Identity() - there.direction * there.direction.transpose()) / distance;
    light.direction = there.direction;
    light.intensity *= there.falloff;
    if (!light.near->covariance_mm2.isZero(0))
        light.covariance = across * light.near->covariance_mm2 * across.transpose();
    light.near->object_mm = object_mm;
    return light;
}

Eigen::Matrix<double, Eigen::Dynamic, 3> direction_matrix(const Lights& lights) {
    const auto used = std::count_if(lights.begin(), lights.end(), [](const Light& l) { return l.used; });
    Eigen::Matrix<double, Eigen::Dynamic, 3> rows(used, 3);
    Eigen::Index row = 0;
    for (const Light& light : lights)
        if (light.used) rows.row(row++) = light.direction.transpose();
    return rows;
}

double condition_number(const Lights& lights) {
    const auto rows = direction_matrix(lights);
    if (rows.rows() < 3) return std::numeric_limits<double>::infinity();
    const Eigen::Vector3d s = Eigen::JacobiSVD<Eigen::MatrixXd>(rows).singularValues();
    if (!(s[2] > s[0] * std::numeric_limits<double>::epsilon())) return std::numeric_limits<double>::infinity();
    return s[0] / s[2];
}

void require_solvable(const Lights& lights) {
    for (const Light& light : lights)
        if (light.used && !light.direction.allFinite())
            throw InputError(fmt::format("the light direction of {} is not a finite number", light.file),
                             "correct it in the lights file, or leave that frame out");
    const auto used = direction_matrix(lights).rows();
    if (used < 3)
        throw InputError(fmt::format("photometric stereo needs at least three lights, but only {} can be used", used),
                         "capture more lamps, or see the calibration's warnings for why lights were left out");
    const double condition = condition_number(lights);
    if (condition > coplanar_condition)
        throw InputError(fmt::format("the {} lights lie in one plane through the object (condition number {:.3g}): "
                                     "normals across that plane have no solution",
                                     used, condition),
                         "add a light well outside the plane of the others");
}

double angle_deg(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    return std::atan2(a.cross(b).norm(), a.dot(b)) * 180.0 / std::numbers::pi;
}

}  // namespace darkbox
