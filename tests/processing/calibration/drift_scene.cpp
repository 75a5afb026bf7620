#include "tests/processing/calibration/drift_scene.h"

#include <cmath>
#include <numbers>
#include <stdexcept>

namespace darkbox::test {
namespace {

constexpr double to_radians = std::numbers::pi / 180;

Eigen::Matrix3d across(const Eigen::Vector3d& direction, double sigma_deg) {
    const double sigma = sigma_deg * to_radians;
    return sigma * sigma * (Eigen::Matrix3d::Identity() - direction * direction.transpose());
}

}  // namespace

RigLights dome(int lamps, double sigma_deg) {
    RigLights rig;
    rig.rig.name = "dome";
    const double golden_angle = std::numbers::pi * (3 - std::sqrt(5.0));
    for (int i = 0; i < lamps; ++i) {
        const double z = 0.95 - 0.55 * i / std::max(1, lamps - 1), r = std::sqrt(1 - z * z);
        Light light;
        light.file = "frame-" + std::to_string(i + 1) + ".png";
        light.direction = {r * std::cos(golden_angle * i), r * std::sin(golden_angle * i), z};
        light.covariance = across(light.direction, sigma_deg);
        rig.lights.push_back(light);
        rig.rig.lamps.push_back("lamp-" + std::to_string(i + 1));
    }
    return rig;
}

RigLights turned(RigLights rig, const Eigen::AngleAxisd& rotation) {
    const Eigen::Matrix3d r = rotation.toRotationMatrix();
    for (Light& light : rig.lights) {
        light.direction = r * light.direction;
        light.covariance = r * light.covariance * r.transpose();
    }
    return rig;
}

void move_lamp(RigLights& rig, std::size_t lamp, double degrees) {
    Light& light = rig.lights[lamp];
    const double sigma_deg = light.sigma_deg();
    const Eigen::Vector3d axis = Eigen::Vector3d::UnitZ().cross(light.direction).normalized();
    light.direction = Eigen::AngleAxisd(degrees * to_radians, axis) * light.direction;
    light.covariance = across(light.direction, sigma_deg);
}

void swap_lamps(RigLights& rig, std::size_t a, std::size_t b) {
    std::swap(rig.lights[a].direction, rig.lights[b].direction);
    std::swap(rig.lights[a].covariance, rig.lights[b].covariance);
}

RigLights measured(RigLights rig, std::mt19937& random) {
    std::normal_distribution<double> normal;
    for (Light& light : rig.lights) {
        const double sigma = light.sigma_deg() * to_radians;
        const Eigen::Vector3d u = light.direction.unitOrthogonal(), v = light.direction.cross(u);
        light.direction = (light.direction + sigma * (normal(random) * u + normal(random) * v)).normalized();
    }
    return rig;
}

const LampDrift& lamp_of(const Drift& drift, const std::string& name) {
    for (const LampDrift& lamp : drift.lamps)
        if (lamp.lamp == name) return lamp;
    throw std::out_of_range(name);
}

std::vector<std::string> found(const Drift& drift, LampFinding finding) {
    std::vector<std::string> names;
    for (const LampDrift& lamp : drift.lamps)
        if (lamp.finding == finding) names.push_back(lamp.lamp);
    return names;
}

}  // namespace darkbox::test
