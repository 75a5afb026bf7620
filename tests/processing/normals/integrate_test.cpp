#include "processing/normals/integrate.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "acquisition/frame/error.h"

namespace darkbox {
namespace {

using Surface = std::function<double(double, double)>;  // z of (u, v), pixels

/// Normals of a height field: (-dz/du, +dz/dv, 1) since y points up and v down.
NormalMap normals_of(const Surface& z, const cv::Mat1b& valid) {
    NormalMap map{cv::Mat3f(valid.size(), cv::Vec3f(0, 0, 0)), valid.clone()};
    constexpr double h = 1e-4;
    for (int v = 0; v < valid.rows; ++v)
        for (int u = 0; u < valid.cols; ++u) {
            if (!valid(v, u)) continue;
            const double du = (z(u + h, v) - z(u - h, v)) / (2 * h), dv = (z(u, v + h) - z(u, v - h)) / (2 * h);
            const cv::Vec3d n(-du, dv, 1);
            map.normal(v, u) = n / cv::norm(n);
        }
    return map;
}

/// RMS difference of the heights, less their means, over the valid pixels.
double rms_error(const cv::Mat1f& height, const Surface& z, const cv::Mat1b& valid) {
    double sum = 0, squares = 0, count = 0;
    for (int v = 0; v < valid.rows; ++v)
        for (int u = 0; u < valid.cols; ++u) {
            if (!valid(v, u)) continue;
            const double d = height(v, u) - z(u, v);
            sum += d, squares += d * d, count += 1;
        }
    return std::sqrt(squares / count - (sum / count) * (sum / count));
}

TEST(IntegrateNormals, AQuadraticIsExactOnAMaskWithAHole) {
    cv::Mat1b valid(60, 80, uchar{255});
    valid(cv::Rect(20, 20, 15, 10)) = 0;
    const Surface z = [](double u, double v) { return 0.01 * u * u - 0.02 * v * v + 0.005 * u * v + 0.3 * u - v; };
    EXPECT_LT(rms_error(integrate_normals(normals_of(z, valid)), z, valid), 2e-3);
}

TEST(IntegrateNormals, ABallBulgesTowardsTheCameraByItsRadius) {
    cv::Mat1b valid(121, 121, uchar{0});
    const Surface z = [](double u, double v) {
        return std::sqrt(std::max(0.0, 3600.0 - (u - 60) * (u - 60) - (v - 60) * (v - 60)));
    };
    for (int v = 0; v < 121; ++v)
        for (int u = 0; u < 121; ++u)
            if (std::hypot(u - 60, v - 60) < 55) valid(v, u) = 255;
    const cv::Mat1f height = integrate_normals(normals_of(z, valid));
    EXPECT_LT(rms_error(height, z, valid), 0.05);
    EXPECT_NEAR(height(60, 60) - height(60, 110), 60 - z(110, 60), 0.1);
}

TEST(IntegrateNormals, EachPartHasMeanHeightZero) {
    cv::Mat1b valid(20, 41, uchar{255});
    valid.col(20) = 0;
    const cv::Mat1f height = integrate_normals(normals_of([](double u, double) { return 0.5 * u; }, valid));
    EXPECT_NEAR(cv::mean(height.colRange(0, 20))[0], 0, 1e-4);
    EXPECT_NEAR(height(3, 10) - height(3, 5), 2.5, 1e-4);
}

TEST(IntegrateNormals, ALargeMapIsSolvedFromCoarseToFine) {
    const cv::Mat1b valid(800, 700, uchar{255});
    const Surface z = [](double u, double v) { return 40 * std::sin(u / 90) * std::cos(v / 120); };
    EXPECT_LT(rms_error(integrate_normals(normals_of(z, valid)), z, valid), 0.1);
}

TEST(IntegrateNormals, NothingToIntegrateIsAnError) {
    EXPECT_THROW(integrate_normals({cv::Mat3f(3, 3), cv::Mat1b(3, 3, uchar{0})}), InputError);
}

}  // namespace
}  // namespace darkbox
