#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <opencv2/core.hpp>

#include "processing/maps/lights.h"
#include "processing/texels/random.h"
#include "processing/transfer/transfer.h"
#include "tests/support/textured_sphere.h"

namespace darkbox::test {

/// A sphere that fills the picture; albedo black and everything invalid outside.
inline NormalMap sphere_normals(int side) { return textured_sphere(side, 3).normals; }

/// Stones of one colour each around random seeds, dark between them; the label tells the stone's colour.
inline TransferSource stony(const NormalMap& normals, int stones, std::uint64_t seed) {
    const cv::Size size = normals.valid.size();
    TransferSource source{
        normals, {cv::Mat3f(size, cv::Vec3f(0, 0, 0)), normals.valid.clone()}, {cv::Mat1w(size, std::uint16_t{0}), 4}};
    SplitMix64 random(seed);
    std::vector<cv::Point2d> seeds;
    for (int i = 0; i < stones; ++i) seeds.emplace_back(random.uniform() * size.width, random.uniform() * size.height);
    for (int y = 0; y < size.height; ++y)
        for (int x = 0; x < size.width; ++x) {
            if (!normals.valid(y, x)) continue;
            double first = 1e9;
            double second = 1e9;
            int stone = 0;
            for (int i = 0; i < stones; ++i) {
                const double d = std::hypot(x - seeds[i].x, y - seeds[i].y);
                second = std::min(second, std::max(first, d));
                if (d < first) stone = i;
                first = std::min(first, d);
            }
            const bool joint = second - first < 1.5;
            const float shade = 0.4F + 0.2F * static_cast<float>(stone % 3);
            source.albedo.albedo(y, x) =
                joint ? cv::Vec3f(0.1F, 0.1F, 0.1F) : cv::Vec3f(shade, 0.8F * shade, 0.5F * shade);
            source.index.label(y, x) = static_cast<std::uint16_t>(joint ? 1 : 2 + stone % 3);
        }
    return source;
}

inline TransferSource stony_sphere(int side) { return stony(sphere_normals(side), side * side / 64, 7); }

/// Smooth waves that face the viewer: their normals lie within 45 degrees of it.
inline NormalMap wavy_normals(cv::Size size) {
    NormalMap map{cv::Mat3f(size), cv::Mat1b(size, std::uint8_t{255})};
    for (int y = 0; y < size.height; ++y)
        for (int x = 0; x < size.width; ++x) {
            const cv::Vec3d n(0.6 * std::sin(x * 0.12), 0.6 * std::cos(y * 0.10), 1);
            map.normal(y, x) = n / cv::norm(n);
        }
    return map;
}

inline NormalMap plane_normals(cv::Size size) {
    return {cv::Mat3f(size, cv::Vec3f(0, 0, 1)), cv::Mat1b(size, std::uint8_t{255})};
}

/// Every value and both maps the same, bit for bit.
inline bool equal(const cv::Mat& a, const cv::Mat& b) {
    if (a.size() != b.size() || a.type() != b.type()) return false;
    for (int y = 0; y < a.rows; ++y)
        if (!std::equal(a.ptr(y), a.ptr(y) + a.cols * a.elemSize(), b.ptr(y))) return false;
    return true;
}

inline TransferOptions by(TransferMethod method) {
    TransferOptions options;
    options.method = method;
    return options;
}

inline TransferResult transferred_on(int threads, const TransferSource& source, const NormalMap& target,
                                     const TransferOptions& options = {}) {
    WorkContext work;
    work.threads = threads;
    return transfer_texture(source, target, options, work);
}

/// Mean over the target of the angle from its normal to that of the source pixel assigned to it.
inline double mean_guide_error_deg(const NormalMap& source, const NormalMap& target, const cv::Mat2i& coordinates) {
    const auto as_eigen = [](const cv::Vec3f& n) { return Eigen::Vector3d(n[0], n[1], n[2]); };
    double sum = 0;
    int count = 0;
    for (int y = 0; y < target.valid.rows; ++y)
        for (int x = 0; x < target.valid.cols; ++x)
            if (target.valid(y, x)) {
                sum += angle_deg(as_eigen(target.normal(y, x)), as_eigen(source.normal(cv::Point(coordinates(y, x)))));
                ++count;
            }
    return sum / count;
}

}  // namespace darkbox::test
