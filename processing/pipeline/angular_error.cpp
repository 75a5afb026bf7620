#include "processing/pipeline/angular_error.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "acquisition/frame/error.h"
#include "processing/maps/lights.h"

namespace darkbox {
namespace {

Eigen::Vector3d to_eigen(const cv::Vec3f& v) { return {v[0], v[1], v[2]}; }

}  // namespace

std::optional<AngularError> summarise_angles(std::vector<double> angles_deg) {
    if (angles_deg.empty()) return std::nullopt;
    std::sort(angles_deg.begin(), angles_deg.end());
    const auto at = [&](double share) {
        return angles_deg[static_cast<std::size_t>(share * static_cast<double>(angles_deg.size() - 1))];
    };
    AngularError error;
    error.count = angles_deg.size();
    error.mean_deg = std::accumulate(angles_deg.begin(), angles_deg.end(), 0.0) / static_cast<double>(error.count);
    error.median_deg = at(0.5);
    error.p95_deg = at(0.95);
    error.max_deg = angles_deg.back();
    return error;
}

cv::Mat1d angles_between_deg(const NormalMap& computed, const NormalMap& truth) {
    if (computed.normal.size() != truth.normal.size())
        throw InputError(fmt::format("the normals are {} x {} pixels, the truth {} x {}", computed.normal.cols,
                                     computed.normal.rows, truth.normal.cols, truth.normal.rows),
                         "compare maps of one size");
    cv::Mat1d angles(truth.normal.size(), std::numeric_limits<double>::quiet_NaN());
    for (int y = 0; y < angles.rows; ++y)
        for (int x = 0; x < angles.cols; ++x)
            if (computed.valid(y, x) && truth.valid(y, x))
                angles(y, x) = angle_deg(to_eigen(computed.normal(y, x)), to_eigen(truth.normal(y, x)));
    return angles;
}

AngularError angular_error(const NormalMap& computed, const NormalMap& truth) {
    const cv::Mat1d angles = angles_between_deg(computed, truth);
    std::vector<double> known;
    std::copy_if(angles.begin(), angles.end(), std::back_inserter(known), [](double a) { return !std::isnan(a); });
    const auto error = summarise_angles(std::move(known));
    if (!error) throw InputError("no pixel is valid in both normal maps", "do both show the same object?");
    return *error;
}

}  // namespace darkbox
