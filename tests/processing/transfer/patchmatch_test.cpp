#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "acquisition/frame/error.h"
#include "tests/processing/transfer/exemplars.h"

namespace darkbox {
namespace {

using test::by;
using test::equal;
using test::mean_guide_error_deg;
using test::plane_normals;
using test::sphere_normals;
using test::stony;
using test::stony_sphere;
using test::transferred_on;
using test::wavy_normals;
using testing::HasSubstr;

/// The share of valid source pixels that are used.
double cover(const TransferSource& source, const cv::Mat2i& coordinates) {
    cv::Mat1b used(source.normals.valid.size(), std::uint8_t{0});
    for (const cv::Vec2i& at : coordinates)
        if (at[0] >= 0) used(at[1], at[0]) = 255;
    return static_cast<double>(cv::countNonZero(used)) / cv::countNonZero(source.normals.valid);
}

class AnyMethod : public testing::TestWithParam<TransferMethod> {};

TEST_P(AnyMethod, IsTheSameOnAnyNumberOfThreads) {
    const TransferSource source = stony_sphere(96);
    NormalMap target = wavy_normals({139, 101});
    target.valid.colRange(40, 47) = std::uint8_t{0};
    const TransferResult one = transferred_on(1, source, target, by(GetParam()));
    for (const int threads : {2, 8}) {
        const TransferResult many = transferred_on(threads, source, target, by(GetParam()));
        EXPECT_TRUE(equal(one.coordinates, many.coordinates)) << threads;
        EXPECT_TRUE(equal(one.normals.normal, many.normals.normal)) << threads;
        EXPECT_TRUE(equal(one.uncovered_deg, many.uncovered_deg)) << threads;
    }
}

TEST_P(AnyMethod, UsesValidSourcePixelsOnly) {
    TransferSource source = stony_sphere(64);
    for (int y = 0; y < 64; ++y)
        for (int x = 0; x < 64; ++x) {
            if ((x / 6 + y / 6) % 5 == 0) source.normals.valid(y, x) = 0;
            if ((x + y) % 11 == 0) source.albedo.valid(y, x) = 0;
            if (!source.normals.valid(y, x) || !source.albedo.valid(y, x)) source.albedo.albedo(y, x) = {9, 9, 9};
        }
    NormalMap target = wavy_normals({70, 50});
    target.valid.colRange(10, 14) = std::uint8_t{0};
    const TransferResult result = transfer_texture(source, target, by(GetParam()));
    for (int y = 0; y < 50; ++y)
        for (int x = 0; x < 70; ++x) {
            const cv::Vec2i at = result.coordinates(y, x);
            if (!target.valid(y, x)) {
                EXPECT_EQ(at, cv::Vec2i(-1, -1));
                continue;
            }
            ASSERT_TRUE(source.normals.valid(at[1], at[0]) && source.albedo.valid(at[1], at[0])) << at;
            EXPECT_EQ(result.albedo.albedo(y, x), source.albedo.albedo(at[1], at[0]));
        }
}

TEST_P(AnyMethod, FollowsTheNormals) {
    const TransferSource source = stony_sphere(128);
    const NormalMap target = wavy_normals({128, 128});
    const TransferResult result = transfer_texture(source, target, by(GetParam()));
    EXPECT_LT(mean_guide_error_deg(source.normals, target, result.coordinates), 9);
}

TEST_P(AnyMethod, WorksForSourcesAndTargetsOfAnyShape) {
    const cv::Size shapes[] = {{1, 1}, {300, 1}, {1, 300}, {3, 5000}, {17, 3}};
    for (const cv::Size size : shapes) {
        const TransferResult onto = transfer_texture(stony_sphere(48), plane_normals(size), by(GetParam()));
        EXPECT_EQ(onto.coordinates.size(), size);
        for (const cv::Vec2i& at : onto.coordinates) EXPECT_GE(at[0], 0);
        const TransferSource thin = stony(plane_normals(size), 20, 5);
        const TransferResult from = transfer_texture(thin, wavy_normals({40, 30}), by(GetParam()));
        for (const cv::Vec2i& at : from.coordinates) EXPECT_TRUE(cv::Rect({}, size).contains(cv::Point(at)));
    }
}

TEST_P(AnyMethod, SaysWhereTheSourceHasNoSuchNormal) {
    NormalMap target = plane_normals({40, 40});
    target.normal.colRange(20, 40) = cv::Vec3f(std::sin(0.7F), 0, std::cos(0.7F));
    target.valid.row(0) = std::uint8_t{0};
    TransferOptions options = by(GetParam());
    options.normal_sigma = 0;
    const TransferResult result = transfer_texture(stony(plane_normals({30, 30}), 20, 5), target, options);
    const double missing = 0.7 * 180 / CV_PI;
    EXPECT_NEAR(result.coverage_deg, missing, 0.01);
    for (int x = 0; x < 40; ++x) {
        EXPECT_EQ(result.uncovered_deg(0, x), 0);
        EXPECT_NEAR(result.uncovered_deg(20, x), x < 20 ? 0 : missing, 0.05) << x;
        EXPECT_GE(result.coordinates(20, x)[0], 0);
    }
}

INSTANTIATE_TEST_SUITE_P(Methods, AnyMethod,
                         testing::Values(TransferMethod::patchmatch, TransferMethod::preview,
                                         TransferMethod::analogies),
                         [](const auto& method) {
                             switch (method.param) {
                                 case TransferMethod::patchmatch:
                                     return "patchmatch";
                                 case TransferMethod::preview:
                                     return "preview";
                                 case TransferMethod::analogies:
                                     break;
                             }
                             return "analogies";
                         });

TEST(UncoveredAngle, IsExactToADegreeOnASphere) {
    const NormalMap sphere = sphere_normals(128);
    TransferOptions options = by(TransferMethod::preview);
    options.normal_sigma = 0;
    const TransferResult result = transfer_texture(stony(sphere, 100, 3), wavy_normals({100, 100}), options);
    EXPECT_LT(*std::max_element(result.uncovered_deg.begin(), result.uncovered_deg.end()), 1.5F);
}

TEST(Patchmatch, IsBetterThanItsSeeds) {
    const TransferSource source = stony_sphere(128);
    const NormalMap target = wavy_normals({128, 128});
    const TransferResult seeds = transfer_texture(source, target, by(TransferMethod::preview));
    const TransferResult refined = transfer_texture(source, target, by(TransferMethod::patchmatch));
    EXPECT_LT(refined.patch_energy.value(), 0.8 * seeds.patch_energy.value());
}

TEST(Patchmatch, UsesMostOfWhatItCouldUse) {
    const TransferSource source = stony(plane_normals({96, 96}), 150, 3);
    const TransferResult result = transfer_texture(source, plane_normals({128, 128}), by(TransferMethod::patchmatch));
    EXPECT_GT(cover(source, result.coordinates), 0.6);
    // Both face the viewer all over: the target's colours should be the source's.
    EXPECT_LT(result.histogram_distance.value(), 5);
}

/// A wall on a sphere: courses of bricks of different reds, light joints of two pixels between them.
constexpr int course = 16;

TransferSource brick_sphere(int side) {
    const NormalMap normals = sphere_normals(side);
    TransferSource source{normals, {cv::Mat3f(side, side, cv::Vec3f(0, 0, 0)), normals.valid.clone()}, {}};
    for (int y = 0; y < side; ++y)
        for (int x = 0; x < side; ++x) {
            if (!normals.valid(y, x)) continue;
            const int along = x + (y / course % 2) * course;
            const bool joint = y % course < 2 || along % (2 * course) < 2;
            const float red = 0.35F + 0.05F * static_cast<float>((y / course * 7 + along / (2 * course) * 3) % 4);
            source.albedo.albedo(y, x) =
                joint ? cv::Vec3f(0.6F, 0.58F, 0.55F) : cv::Vec3f(red, 0.3F * red, 0.15F * red);
        }
    return source;
}

/// Of the target's pixels on a bed joint, the share whose right-hand neighbour goes on with it, give or take a pixel.
double unbroken_courses(const cv::Mat2i& coordinates) {
    int on_joint = 0;
    int unbroken = 0;
    for (int y = 0; y < coordinates.rows; ++y)
        for (int x = 1; x < coordinates.cols; ++x) {
            if (coordinates(y, x - 1)[1] % course >= 2) continue;
            ++on_joint;
            const int next = coordinates(y, x)[1] % course;
            if (next <= 2 || next == course - 1) ++unbroken;
        }
    return static_cast<double>(unbroken) / on_joint;
}

TEST(Refined, BricksKeepTheirCourses) {
    const TransferSource source = brick_sphere(256);
    NormalMap hills = plane_normals({256, 256});
    for (int y = 0; y < 256; ++y)
        for (int x = 0; x < 256; ++x) {
            const cv::Vec3d n(0.6 * std::sin(x * 0.04), 0.6 * std::cos(y * 0.035), 1);
            hills.normal(y, x) = n / cv::norm(n);
        }
    const auto unbroken = [&](TransferMethod method) {
        return unbroken_courses(transfer_texture(source, hills, by(method)).coordinates);
    };
    const double preview = unbroken(TransferMethod::preview);
    const double patchmatch = unbroken(TransferMethod::patchmatch);
    const double analogies = unbroken(TransferMethod::analogies);
    RecordProperty("unbroken_preview", std::to_string(preview));
    RecordProperty("unbroken_patchmatch", std::to_string(patchmatch));
    RecordProperty("unbroken_analogies", std::to_string(analogies));
    EXPECT_GT(patchmatch, 0.97);
    EXPECT_GT(patchmatch, preview);
    EXPECT_GT(analogies, 0.97);
}

TEST(Patchmatch, SeedsDiffer) {
    const TransferSource source = stony_sphere(64);
    const NormalMap target = wavy_normals({64, 64});
    TransferOptions other = by(TransferMethod::patchmatch);
    other.seed = 2;
    const TransferResult first = transfer_texture(source, target, by(TransferMethod::patchmatch));
    EXPECT_FALSE(equal(first.coordinates, transfer_texture(source, target, other).coordinates));
}

TEST(Patchmatch, AControlMapTellsWhereWhatGoes) {
    TransferSource source{plane_normals({64, 64}), {cv::Mat3f(64, 64), cv::Mat1b(64, 64, std::uint8_t{255})}, {}};
    source.albedo.albedo.colRange(0, 32) = cv::Vec3f(0.6F, 0.3F, 0.1F);
    source.albedo.albedo.colRange(32, 64) = cv::Vec3f(0.1F, 0.3F, 0.6F);
    ControlMaps control{cv::Mat3f(64, 64, cv::Vec3f(0, 0, 0)), cv::Mat3f(64, 64, cv::Vec3f(0, 0, 0))};
    control.source.colRange(0, 32) = cv::Vec3f(1, 1, 1);
    control.target.rowRange(0, 32) = cv::Vec3f(1, 1, 1);
    TransferOptions options = by(TransferMethod::patchmatch);
    options.control_weight = 4;
    const TransferResult result = transfer_texture(source, plane_normals({64, 64}), options, {}, control);
    int red_above = 0;
    int red_below = 0;
    for (int y = 0; y < 64; ++y)
        for (int x = 0; x < 64; ++x) (y < 32 ? red_above : red_below) += result.albedo.albedo(y, x)[0] > 0.5F ? 1 : 0;
    EXPECT_GT(red_above, 0.95 * 32 * 64);
    EXPECT_LT(red_below, 0.05 * 32 * 64);
}

TEST(Patchmatch, ControlMapsThatDoNotFitAreRefused) {
    const TransferSource source = stony_sphere(32);
    const NormalMap target = plane_normals({16, 16});
    const auto refusal = [&](const ControlMaps& control, TransferMethod method) -> std::string {
        try {
            transfer_texture(source, target, by(method), {}, control);
        } catch (const InputError& error) {
            return error.what();
        }
        return "accepted";
    };
    const cv::Mat3f fits(32, 32, cv::Vec3f(0, 0, 0));
    cv::Mat3f broken(16, 16, cv::Vec3f(0, 0, 0));
    EXPECT_EQ(refusal({fits, broken}, TransferMethod::patchmatch), "accepted");
    EXPECT_THAT(refusal({fits, broken}, TransferMethod::analogies), HasSubstr("patchmatch only"));
    EXPECT_THAT(refusal({fits, {}}, TransferMethod::patchmatch), HasSubstr("the target's control map is 0x0"));
    EXPECT_THAT(refusal({broken, broken}, TransferMethod::patchmatch), HasSubstr("the source's control map is 16x16"));
    broken(3, 3)[1] = std::numeric_limits<float>::quiet_NaN();
    EXPECT_THAT(refusal({fits, broken}, TransferMethod::patchmatch), HasSubstr("not finite"));
}

}  // namespace
}  // namespace darkbox
