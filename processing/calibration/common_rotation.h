#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <vector>

namespace darkbox {

/// One lamp's direction in two calibrations, and how far the two can differ by chance.
struct DirectionPair {
    Eigen::Vector3d before{0, 0, 1};
    Eigen::Vector3d after{0, 0, 1};
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< of after - before, rad^2, across the direction
};

/// How far one pair is from `after = rotation * before`.
struct Mismatch {
    double angle_deg = 0;
    double chi_squared = 0;  ///< two degrees of freedom, on the tangent plane
    double p_value() const;  ///< of so much or more by chance: exp(-chi_squared / 2)
};
/// `extra` is added to the pair's covariance: what the rotation itself is not known to, rad^2.
Mismatch mismatch(const DirectionPair& pair, const Eigen::Matrix3d& rotation,
                  const Eigen::Matrix3d& extra = Eigen::Matrix3d::Zero());

/// The rotation that most pairs share.
struct CommonRotation {
    Eigen::Matrix3d after_from_before = Eigen::Matrix3d::Identity();
    Eigen::Matrix3d information = Eigen::Matrix3d::Zero();  ///< inverse covariance of the rotation vector, rad^-2
    std::vector<bool> follows;                              ///< by pair: it takes part in the fit

    Eigen::Vector3d vector_deg() const;  ///< axis times angle
    std::size_t followers() const;
};

/// Robust: of the rotations that two pairs each define, the one whose better half of mismatches is least (least trimmed
/// squares), then Kabsch's over the pairs that follow it (Kabsch 1976, Acta Cryst. A32), then weighted by covariances.
/// None for fewer than three pairs, or where less than a majority of at least three follows.
std::optional<CommonRotation> common_rotation(const std::vector<DirectionPair>& pairs);

/// The same without one pair's say, so that this pair can be judged by it. None where too few others are left.
std::optional<CommonRotation> without(const CommonRotation& common, const std::vector<DirectionPair>& pairs,
                                      std::size_t left_out);

/// Covariance of a direction that `common` turns, rad^2.
Eigen::Matrix3d covariance_through(const CommonRotation& common, const Eigen::Vector3d& direction);

}  // namespace darkbox
