#include "processing/transfer/pyramid.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace darkbox {
namespace {

constexpr int shortest_side = 32;
constexpr std::array<float, 4> binomial{1, 3, 3, 1};

/// Normals of a level that point every way may cancel out; those stay as short as they are.
cv::Vec3f made_unit(const cv::Vec3f& n) {
    const float length = std::sqrt(n.dot(n));
    return length > 1e-6F ? cv::Vec3f(n[0] / length, n[1] / length, n[2] / length) : n;
}

bool any_child(const cv::Mat1b& valid, int x, int y) {
    for (int v = 2 * y; v < std::min(2 * y + 2, valid.rows); ++v)
        for (int u = 2 * x; u < std::min(2 * x + 2, valid.cols); ++u)
            if (valid(v, u)) return true;
    return false;
}

void set_parent(const MapLevel& fine, int x, int y, MapLevel& coarse) {
    cv::Vec3f normal(0, 0, 0);
    cv::Vec3f albedo(0, 0, 0);
    float sum = 0;
    for (int j = 0; j < 4; ++j)
        for (int i = 0; i < 4; ++i) {
            const cv::Point p(2 * x - 1 + i, 2 * y - 1 + j);
            if (!fine.has(p)) continue;
            const float weight = binomial[i] * binomial[j];
            normal += weight * fine.normal(p);
            albedo += weight * fine.albedo(p);
            sum += weight;
        }
    coarse.normal(y, x) = made_unit(normal * (1 / sum));
    coarse.albedo(y, x) = albedo * (1 / sum);
    coarse.valid(y, x) = 255;
}

MapLevel half_size(const MapLevel& fine) {
    const cv::Size size((fine.valid.cols + 1) / 2, (fine.valid.rows + 1) / 2);
    MapLevel coarse{cv::Mat3f(size, cv::Vec3f(0, 0, 0)), cv::Mat3f(size, cv::Vec3f(0, 0, 0)),
                    cv::Mat1b(size, std::uint8_t{0})};
    tbb::parallel_for(0, size.height, [&](int y) {
        for (int x = 0; x < size.width; ++x)
            if (any_child(fine.valid, x, y)) set_parent(fine, x, y, coarse);
    });
    return coarse;
}

}  // namespace

NormalMap low_pass(const NormalMap& normals, double sigma) {
    NormalMap smooth{cv::Mat3f(normals.normal.size(), cv::Vec3f(0, 0, 0)), normals.valid.clone()};
    normals.normal.copyTo(smooth.normal, normals.valid);
    // Dividing by the blurred mask would only change lengths, and the normals are made unit anyway.
    if (sigma > 0) cv::GaussianBlur(smooth.normal, smooth.normal, cv::Size(), sigma, sigma, cv::BORDER_CONSTANT);
    tbb::parallel_for(0, smooth.normal.rows, [&](int y) {
        for (int x = 0; x < smooth.normal.cols; ++x) {
            cv::Vec3f& n = smooth.normal(y, x);
            n = smooth.valid(y, x) ? made_unit(n) : cv::Vec3f(0, 0, 0);
        }
    });
    return smooth;
}

MapPyramid map_pyramid(MapLevel finest, int levels) {
    MapPyramid pyramid{std::move(finest)};
    while (static_cast<int>(pyramid.size()) < levels) pyramid.push_back(half_size(pyramid.back()));
    return pyramid;
}

int pyramid_levels(int asked, cv::Size source, cv::Size target) {
    if (asked > 0) return asked;
    int side = std::min({source.width, source.height, target.width, target.height});
    int levels = 1;
    for (; side >= 2 * shortest_side; side /= 2) ++levels;
    return levels;
}

}  // namespace darkbox
