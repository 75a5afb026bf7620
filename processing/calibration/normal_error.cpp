#include "processing/calibration/normal_error.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace darkbox {
namespace {

constexpr double largest_axis_error = 0.1;  // of albedo 1

}  // namespace

std::vector<Eigen::Vector3d> visible_normals(int count) {
    const double golden_angle = std::numbers::pi * (3.0 - std::sqrt(5.0));
    std::vector<Eigen::Vector3d> normals;
    normals.reserve(static_cast<std::size_t>(count));
    for (int i = 0; i < count; ++i) {
        const double z = 1.0 - (i + 0.5) / count;  // equal steps in height are equal areas of the sphere
        const double in_plane = std::sqrt(1.0 - z * z);
        normals.emplace_back(in_plane * std::cos(golden_angle * i), in_plane * std::sin(golden_angle * i), z);
    }
    return normals;
}

double normal_error_deg(const Eigen::Matrix3d& information, const Eigen::Vector3d& normal, double noise) {
    const Eigen::Matrix3d covariance = (information / (noise * noise) + Eigen::Matrix3d::Identity()).inverse();
    const double across = covariance.trace() - normal.dot(covariance * normal);
    return std::sqrt(std::max(0.0, across)) * 180.0 / std::numbers::pi;
}

bool determines_normals(const Eigen::Matrix3d& information) {
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen;
    eigen.computeDirect(information, Eigen::EigenvaluesOnly);
    const double needed = reference_noise / largest_axis_error;
    return eigen.eigenvalues()[0] >= needed * needed;
}

}  // namespace darkbox
