#include "processing/calibration/common_rotation.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "processing/maps/lights.h"

namespace darkbox {
namespace {

constexpr std::size_t fewest = 3;
constexpr double gate = 18.4;          // chi-squared of two degrees of freedom that chance exceeds once in 10,000
constexpr double least_spread = 0.05;  // sine between two directions that define a rotation
constexpr int most_iterations = 20;

Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v) {
    Eigen::Matrix3d m;
    m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
    return m;
}

/// Two unit vectors across `direction`, as columns.
Eigen::Matrix<double, 3, 2> tangents(const Eigen::Vector3d& direction) {
    Eigen::Matrix<double, 3, 2> basis;
    basis.col(0) = direction.unitOrthogonal();
    basis.col(1) = direction.cross(basis.col(0));
    return basis;
}

Eigen::Matrix2d tangent_information(const Eigen::Matrix3d& covariance, const Eigen::Matrix<double, 3, 2>& basis) {
    return Eigen::Matrix2d(basis.transpose() * covariance * basis).inverse();
}

/// Kabsch: the rotation that takes `before` nearest to `after` over the pairs that follow.
Eigen::Matrix3d kabsch(const std::vector<DirectionPair>& pairs, const std::vector<bool>& follows) {
    Eigen::Matrix3d correlation = Eigen::Matrix3d::Zero();
    for (std::size_t i = 0; i < pairs.size(); ++i)
        if (follows[i]) correlation += pairs[i].after * pairs[i].before.transpose();
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(correlation, Eigen::ComputeFullU | Eigen::ComputeFullV);
    Eigen::Vector3d signs(1, 1, (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1);
    return svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
}

/// Gauss and Newton's steps on the rotation vector, each pair weighed by its covariance.
void refine(const std::vector<DirectionPair>& pairs, CommonRotation& common) {
    for (int iteration = 0; iteration < most_iterations; ++iteration) {
        common.information.setZero();
        Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
        for (std::size_t i = 0; i < pairs.size(); ++i) {
            if (!common.follows[i]) continue;
            const Eigen::Vector3d turned = common.after_from_before * pairs[i].before;
            const auto basis = tangents(pairs[i].after);
            const Eigen::Matrix2d weight = tangent_information(pairs[i].covariance, basis);
            const Eigen::Matrix<double, 2, 3> jacobian = -basis.transpose() * cross_matrix(turned);
            common.information += jacobian.transpose() * weight * jacobian;
            gradient += jacobian.transpose() * weight * basis.transpose() * (pairs[i].after - turned);
        }
        const Eigen::Vector3d turn = common.information.ldlt().solve(gradient);
        if (!turn.allFinite()) return;
        const double angle = turn.norm();
        if (angle > 0)
            common.after_from_before =
                Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix() * common.after_from_before;
        if (angle < 1e-12) return;
    }
}

std::size_t count(const std::vector<bool>& follows) {
    return static_cast<std::size_t>(std::count(follows.begin(), follows.end(), true));
}

std::vector<bool> followers_of(const std::vector<DirectionPair>& pairs, const Eigen::Matrix3d& rotation) {
    std::vector<bool> follows(pairs.size());
    for (std::size_t i = 0; i < pairs.size(); ++i) follows[i] = mismatch(pairs[i], rotation).chi_squared < gate;
    return follows;
}

/// Sum over the better half of the pairs.
double trimmed_mismatch(const std::vector<DirectionPair>& pairs, const Eigen::Matrix3d& rotation) {
    std::vector<double> chi_squared;
    for (const DirectionPair& pair : pairs) chi_squared.push_back(mismatch(pair, rotation).chi_squared);
    const std::size_t kept = std::max(fewest, pairs.size() / 2 + 1);
    std::sort(chi_squared.begin(), chi_squared.end());
    double sum = 0;
    for (std::size_t i = 0; i < kept; ++i) sum += chi_squared[i];
    return sum;
}

Eigen::Matrix3d best_of_twos(const std::vector<DirectionPair>& pairs) {
    Eigen::Matrix3d best = Eigen::Matrix3d::Identity();
    double least = trimmed_mismatch(pairs, best);
    for (std::size_t i = 0; i < pairs.size(); ++i)
        for (std::size_t j = i + 1; j < pairs.size(); ++j) {
            if (pairs[i].before.cross(pairs[j].before).norm() < least_spread) continue;
            std::vector<bool> two(pairs.size(), false);
            two[i] = two[j] = true;
            const Eigen::Matrix3d rotation = kabsch(pairs, two);
            const double sum = trimmed_mismatch(pairs, rotation);
            if (sum < least) {
                least = sum;
                best = rotation;
            }
        }
    return best;
}

}  // namespace

double Mismatch::p_value() const { return std::exp(-chi_squared / 2); }

Mismatch mismatch(const DirectionPair& pair, const Eigen::Matrix3d& rotation, const Eigen::Matrix3d& extra) {
    const Eigen::Vector3d turned = rotation * pair.before;
    const double angle = std::atan2(turned.cross(pair.after).norm(), turned.dot(pair.after));
    // The difference laid into the tangent plane at its full angle: a chord would let opposite directions agree.
    Eigen::Vector3d across = pair.after - pair.after.dot(turned) * turned;
    if (across.norm() < 1e-15) across = angle > 1 ? Eigen::Vector3d(turned.unitOrthogonal()) : Eigen::Vector3d::Zero();
    if (across.norm() > 0) across *= angle / across.norm();
    const auto basis = tangents(turned);
    const Eigen::Vector2d difference = basis.transpose() * across;
    return {angle * 180 / std::numbers::pi,
            difference.dot(tangent_information(pair.covariance + extra, basis) * difference)};
}

Eigen::Vector3d CommonRotation::vector_deg() const {
    const Eigen::AngleAxisd turn(after_from_before);
    return turn.axis() * turn.angle() * 180 / std::numbers::pi;
}

std::size_t CommonRotation::followers() const { return count(follows); }

std::optional<CommonRotation> common_rotation(const std::vector<DirectionPair>& pairs) {
    if (pairs.size() < fewest) return std::nullopt;
    CommonRotation common;
    common.after_from_before = best_of_twos(pairs);
    for (int round = 0; round < most_iterations; ++round) {
        const std::vector<bool> follows = followers_of(pairs, common.after_from_before);
        if (count(follows) < std::max(fewest, pairs.size() / 2 + 1)) return std::nullopt;
        if (follows == common.follows) break;
        common.follows = follows;
        common.after_from_before = kabsch(pairs, follows);
        refine(pairs, common);
    }
    return common;
}

std::optional<CommonRotation> without(const CommonRotation& common, const std::vector<DirectionPair>& pairs,
                                      std::size_t left_out) {
    CommonRotation others = common;
    if (!others.follows[left_out]) return others;
    others.follows[left_out] = false;
    if (others.followers() < 2) return std::nullopt;
    refine(pairs, others);
    return others;
}

Eigen::Matrix3d covariance_through(const CommonRotation& common, const Eigen::Vector3d& direction) {
    const Eigen::Matrix3d jacobian = cross_matrix(common.after_from_before * direction);
    return jacobian * common.information.inverse() * jacobian.transpose();
}

}  // namespace darkbox
