#include "processing/transfer/relief.h"

#include <tbb/parallel_for.h>

#include <cmath>

namespace darkbox {
namespace {

cv::Vec3f unit(const cv::Vec3f& v) { return v * (1 / std::sqrt(v.dot(v))); }

cv::Vec3f across(const cv::Vec3f& v) {
    const cv::Vec3f axis = std::abs(v[0]) < 0.5F ? cv::Vec3f(1, 0, 0) : cv::Vec3f(0, 1, 0);
    return unit(axis - v * v.dot(axis));
}

}  // namespace

cv::Vec3f turned(const cv::Vec3f& v, const cv::Vec3f& from, const cv::Vec3f& to) {
    const float cosine = from.dot(to);
    if (cosine < -0.9999F) {
        const cv::Vec3f axis = across(from);
        return axis * (2 * axis.dot(v)) - v;
    }
    // Rodrigues' formula with the sine folded into the axis.
    const cv::Vec3f axis = from.cross(to);
    return v * cosine + axis.cross(v) + axis * (axis.dot(v) / (1 + cosine));
}

NormalMap moved_relief(const NormalMap& source, const MapLevel& smooth, const cv::Mat2i& coordinates,
                       const NormalMap& target) {
    NormalMap moved{cv::Mat3f(target.valid.size()), target.valid.clone()};
    tbb::parallel_for(0, target.valid.rows, [&](int y) {
        for (int x = 0; x < target.valid.cols; ++x) {
            moved.normal(y, x) = {0, 0, 0};
            if (!target.valid(y, x)) continue;
            const cv::Point at(coordinates(y, x));
            moved.normal(y, x) = unit(turned(source.normal(at), smooth.normal(at), unit(target.normal(y, x))));
        }
    });
    return moved;
}

}  // namespace darkbox
