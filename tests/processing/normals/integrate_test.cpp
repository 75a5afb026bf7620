#include "processing/normals/integrate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "acquisition/frame/error.h"
#include "tests/support/throws.h"

namespace darkbox {
namespace {

using test::input_error_of;
using testing::HasSubstr;

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
    return std::sqrt(std::max(0.0, squares / count - (sum / count) * (sum / count)));
}

cv::Mat1f height_of(const NormalMap& normals, IntegrationMethod method = IntegrationMethod::bilateral) {
    IntegrationOptions options;
    options.method = method;
    return integrate_normals({normals}, options).height;
}

void add_noise(NormalMap& map, double sigma) {
    cv::theRNG().state = 5;
    cv::Mat3f noise(map.normal.size());
    cv::randn(noise, cv::Scalar::all(0), cv::Scalar::all(sigma));
    for (int v = 0; v < noise.rows; ++v)
        for (int u = 0; u < noise.cols; ++u)
            if (map.valid(v, u)) map.normal(v, u) = cv::normalize(map.normal(v, u) + noise(v, u));
}

/// The right half rises away from the line v = 180 that it shares with the flat rest: a step from 0 to 36 pixels.
double fold(double u, double v) { return u > 149.5 && v < 180 ? 0.2 * (180 - v) : 0.0; }

NormalMap fold_normals() { return normals_of(fold, cv::Mat1b(300, 300, uchar{255})); }

TEST(IntegrateNormals, AnInclinedPlaneIsExact) {
    const cv::Mat1b valid(150, 130, uchar{255});
    const Surface z = [](double u, double v) { return 0.7 * u - 0.3 * v; };
    EXPECT_LT(rms_error(height_of(normals_of(z, valid)), z, valid), 1e-3);
}

TEST(IntegrateNormals, AQuadraticIsExactOnAMaskWithAHole) {
    cv::Mat1b valid(60, 80, uchar{255});
    valid(cv::Rect(20, 20, 15, 10)) = 0;
    const Surface z = [](double u, double v) { return 0.01 * u * u - 0.02 * v * v + 0.005 * u * v + 0.3 * u - v; };
    EXPECT_LT(rms_error(height_of(normals_of(z, valid)), z, valid), 2e-3);
}

TEST(IntegrateNormals, ABallBulgesTowardsTheCameraByItsRadius) {
    cv::Mat1b valid(121, 121, uchar{0});
    const Surface z = [](double u, double v) {
        return std::sqrt(std::max(0.0, 3600.0 - (u - 60) * (u - 60) - (v - 60) * (v - 60)));
    };
    for (int v = 0; v < 121; ++v)
        for (int u = 0; u < 121; ++u)
            if (std::hypot(u - 60, v - 60) < 55) valid(v, u) = 255;
    const cv::Mat1f height = height_of(normals_of(z, valid));
    EXPECT_LT(rms_error(height, z, valid), 0.02);
    EXPECT_NEAR(height(60, 60) - height(60, 110), 60 - z(110, 60), 0.05);
}

TEST(IntegrateNormals, EachPartHasMeanHeightZero) {
    cv::Mat1b valid(20, 41, uchar{255});
    valid.col(20) = 0;
    const HeightMap map = integrate_normals({normals_of([](double u, double) { return 0.5 * u; }, valid)});
    EXPECT_EQ(map.parts, 2);
    EXPECT_NEAR(cv::mean(map.height.colRange(0, 20))[0], 0, 1e-4);
    EXPECT_NEAR(map.height(3, 10) - map.height(3, 5), 2.5, 1e-4);
    EXPECT_EQ(map.height(3, 20), 0);
}

TEST(IntegrateNormals, ManyLonelyPixelsAreSolvedToo) {
    cv::Mat1b valid(80, 80, uchar{0});
    for (int v = 0; v < 80; v += 2)
        for (int u = 0; u < 80; u += 2) valid(v, u) = 255;
    const HeightMap map = integrate_normals({normals_of([](double u, double) { return u; }, valid)});
    EXPECT_EQ(map.parts, 1600);
    EXPECT_EQ(cv::countNonZero(map.height), 0);
    EXPECT_EQ(integrate_normals({normals_of([](double, double) { return 0; }, cv::Mat1b(1, 1, uchar{255}))}).parts, 1);
}

TEST(IntegrateNormals, AStepStaysAStepWhereLeastSquaresSmearsIt) {
    const NormalMap normals = fold_normals();
    const double old = rms_error(height_of(normals, IntegrationMethod::least_squares), fold, normals.valid);
    const double bilateral = rms_error(height_of(normals), fold, normals.valid);
    EXPECT_GT(old, 5) << "least squares has no choice but to smear the step";
    EXPECT_LT(bilateral, old / 4);
    const HeightMap map = integrate_normals({normals});
    EXPECT_NEAR(map.height(20, 152) - map.height(20, 147), 32, 1.5);
    int cuts = 0;  // a step is found to within the two pixels that a coarser level stands for
    for (int v = 0; v < 150; ++v) cuts += cv::countNonZero(map.cut(cv::Rect(147, v, 5, 1)) & cut_right) == 1;
    EXPECT_GT(cuts, 140) << "the mesh must know of the step";
    EXPECT_EQ(cv::countNonZero(map.cut.colRange(0, 140)), 0);
}

TEST(IntegrateNormals, NoiseDoesNotBreakASmoothSurface) {
    const cv::Mat1b valid(256, 256, uchar{255});
    const Surface z = [](double u, double v) { return 15 * std::sin(u / 30) * std::cos(v / 40); };
    NormalMap normals = normals_of(z, valid);
    add_noise(normals, 0.05);
    const double old = rms_error(height_of(normals, IntegrationMethod::least_squares), z, valid);
    const HeightMap map = integrate_normals({normals});
    EXPECT_LT(rms_error(map.height, z, valid), 1.05 * old);
    EXPECT_LT(cv::countNonZero(map.cut), 5);
}

TEST(IntegrateNormals, ConfidenceSaysWhichNormalsToBelieve) {
    const cv::Mat1b valid(100, 100, uchar{255});
    const Surface z = [](double u, double v) { return 0.3 * u + 0.1 * v; };
    NormalMap normals = normals_of(z, valid);
    cv::Mat1f confidence(valid.size(), 1.0F);
    for (int v = 40; v < 60; ++v) {
        confidence(v, 50) = 1e-4F;
        normals.normal(v, 50) = cv::normalize(cv::Vec3f(1, 0, 1));
    }
    const double blind = rms_error(height_of(normals), z, valid);
    EXPECT_LT(rms_error(integrate_normals({normals, {}, confidence}).height, z, valid), 0.3 * blind);
    confidence(3, 4) = std::nanf("");
    EXPECT_THAT(input_error_of([&] { integrate_normals({normals, {}, confidence}); }), HasSubstr("(4, 3) is nan"));
}

TEST(IntegrateNormals, ALargeMapIsSolvedFromCoarseToFine) {
    const cv::Mat1b valid(800, 700, uchar{255});
    const Surface z = [](double u, double v) { return 40 * std::sin(u / 90) * std::cos(v / 120); };
    EXPECT_LT(rms_error(height_of(normals_of(z, valid)), z, valid), 0.01);
}

TEST(IntegrateNormals, MillimetresFollowFromTheView) {
    const cv::Mat1b valid(40, 50, uchar{255});
    const NormalMap normals = normals_of([](double u, double) { return 0.5 * u; }, valid);
    EXPECT_EQ(integrate_normals({normals}).unit, HeightUnit::pixels);
    const HeightMap map = integrate_normals({normals, ViewGeometry{0.2, {24.5, 19.5}}});
    EXPECT_EQ(map.unit, HeightUnit::millimetres);
    EXPECT_NEAR(map.height(10, 30) - map.height(10, 20), 1.0, 1e-3);
}

/// What a perspective camera 500 mm away sees of a surface, given the distance along each ray's depth.
struct Seen {
    NormalMap normals{cv::Mat3f(241, 301, cv::Vec3f(0, 0, 0)), cv::Mat1b(241, 301, uchar{0})};
    cv::Mat1d z = cv::Mat1d(241, 301, 0.0);
};
const ViewGeometry near_camera{0.8, {150, 120}, 500};

Eigen::Vector3d ray_through(int u, int v) {
    return near_camera.point_at(cv::Point2d(u, v)) - Eigen::Vector3d(0, 0, near_camera.distance_mm);
}

/// RMS of z against the truth in millimetres, the free scale of the whole scene fitted to the mean.
double perspective_rms(const HeightMap& map, const Seen& seen) {
    const double camera = near_camera.distance_mm;
    double ratio = 0, count = 0, squares = 0;
    const auto over_valid = [&](auto&& body) {
        for (int v = 0; v < map.valid.rows; ++v)
            for (int u = 0; u < map.valid.cols; ++u)
                if (map.valid(v, u)) body(v, u);
    };
    over_valid([&](int v, int u) { ratio += (camera - seen.z(v, u)) / (camera - map.height(v, u)), ++count; });
    ratio /= count;
    over_valid([&](int v, int u) {
        const double off = ratio * (camera - map.height(v, u)) - (camera - seen.z(v, u));
        squares += off * off;
    });
    return std::sqrt(squares / count);
}

TEST(IntegrateNormals, APerspectivePlaneIsFlat) {
    const Eigen::Vector3d normal = Eigen::Vector3d(0.3, -0.2, 1).normalized();
    Seen seen;
    for (int v = 0; v < seen.z.rows; ++v)
        for (int u = 0; u < seen.z.cols; ++u) {
            const Eigen::Vector3d ray = ray_through(u, v), camera(0, 0, near_camera.distance_mm);
            const double along = -normal.dot(camera) / normal.dot(ray);
            seen.z(v, u) = (camera + along * ray).z();
            seen.normals.normal(v, u) = {static_cast<float>(normal.x()), static_cast<float>(normal.y()),
                                         static_cast<float>(normal.z())};
            seen.normals.valid(v, u) = 255;
        }
    const HeightMap map = integrate_normals({seen.normals, near_camera});
    EXPECT_LT(perspective_rms(map, seen), 0.02);
    const HeightMap flat = integrate_normals({seen.normals, ViewGeometry{0.8, {150, 120}}});
    EXPECT_GT(perspective_rms(flat, seen), 1.0) << "the orthographic answer is not good enough to pass";
}

TEST(IntegrateNormals, APerspectiveBallIsRound) {
    const Eigen::Vector3d centre(15, -10, -20);
    constexpr double radius = 70;
    Seen seen;
    for (int v = 0; v < seen.z.rows; ++v)
        for (int u = 0; u < seen.z.cols; ++u) {
            const Eigen::Vector3d ray = ray_through(u, v).normalized(), camera(0, 0, near_camera.distance_mm);
            const double middle = ray.dot(centre - camera);
            const double rest = radius * radius - ((centre - camera).squaredNorm() - middle * middle);
            if (rest < 0.1 * radius * radius) continue;
            const Eigen::Vector3d point = camera + (middle - std::sqrt(rest)) * ray;
            const Eigen::Vector3d n = (point - centre) / radius;
            seen.z(v, u) = point.z();
            seen.normals.normal(v, u) = {static_cast<float>(n.x()), static_cast<float>(n.y()),
                                         static_cast<float>(n.z())};
            seen.normals.valid(v, u) = 255;
        }
    EXPECT_LT(perspective_rms(integrate_normals({seen.normals, near_camera}), seen), 0.03);
}

TEST(IntegrateNormals, TheSameBitsOnAnyNumberOfThreads) {
    NormalMap normals = fold_normals();
    add_noise(normals, 0.03);
    const cv::Mat1f one = integrate_normals({normals}, {}, {.report = {}, .stop = {}, .threads = 1}).height;
    const cv::Mat1f many = integrate_normals({normals}, {}, {.report = {}, .stop = {}, .threads = 5}).height;
    EXPECT_EQ(cv::norm(one, many, cv::NORM_INF), 0);
}

TEST(IntegrateNormals, NothingToIntegrateIsAnError) {
    EXPECT_THROW(integrate_normals({{cv::Mat3f(3, 3), cv::Mat1b(3, 3, uchar{0})}}), InputError);
    EXPECT_THAT(input_error_of([] { IntegrationOptions{.breaks_at = 0}.validate(); }), HasSubstr("breaks_at is 0"));
    std::stop_source stop;
    stop.request_stop();
    EXPECT_THROW(integrate_normals({fold_normals()}, {}, {.report = {}, .stop = stop.get_token()}), Cancelled);
}

}  // namespace
}  // namespace darkbox
