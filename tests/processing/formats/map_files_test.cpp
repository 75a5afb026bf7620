#include "processing/formats/map_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "processing/formats/exr.h"
#include "processing/formats/png.h"
#include "processing/maps/srgb.h"
#include "tests/support/test_data.h"
#include "tests/support/throws.h"

namespace darkbox {
namespace {

using test::input_error_of;
using testing::HasSubstr;

/// A ball that fills the picture; its corners are not valid.
NormalMap ball_normals(int size) {
    NormalMap map{cv::Mat3f(size, size, cv::Vec3f(0, 0, 0)), cv::Mat1b(size, size, uchar{0})};
    const float centre = static_cast<float>(size - 1) / 2.0F, radius = static_cast<float>(size) / 2.0F;
    for (int v = 0; v < size; ++v)
        for (int u = 0; u < size; ++u) {
            const float x = (static_cast<float>(u) - centre) / radius, y = -(static_cast<float>(v) - centre) / radius;
            if (x * x + y * y >= 0.98F) continue;
            map.normal(v, u) = {x, y, std::sqrt(1 - x * x - y * y)};
            map.valid(v, u) = 255;
        }
    return map;
}

class MapFiles : public testing::Test {
protected:
    std::filesystem::path at(const std::string& name) const { return folder_.path() / name; }
    test::TemporaryFolder folder_;
};

TEST_F(MapFiles, NormalsComeBackFromExrAndPng) {
    const NormalMap normals = ball_normals(33);
    for (const auto& [name, tolerance] : {std::pair("n.exr", 1e-6), std::pair("n.png", 3e-5)}) {
        write_normal_map(at(name), normals);
        const NormalMap read = read_normal_map(at(name));
        EXPECT_EQ(cv::norm(read.valid, normals.valid, cv::NORM_INF), 0);
        EXPECT_LT(cv::norm(read.normal, normals.normal, cv::NORM_INF), tolerance) << name;
    }
}

TEST_F(MapFiles, PngHasRedForXGreenForUpBlueForTheCamera) {
    NormalMap normals{cv::Mat3f(1, 4, cv::Vec3f(0, 0, 0)), cv::Mat1b(1, 4, uchar{255})};
    normals.normal(0, 0) = {1, 0, 0};
    normals.normal(0, 1) = {0, 1, 0};
    normals.normal(0, 2) = {0, 0, 1};
    normals.valid(0, 3) = 0;
    write_normal_map(at("n.png"), normals);
    const cv::Mat3w png = read_png(at("n.png"));
    EXPECT_EQ(png(0, 0), cv::Vec3w(65535, 32768, 32768));
    EXPECT_EQ(png(0, 1), cv::Vec3w(32768, 65535, 32768));
    EXPECT_EQ(png(0, 2), cv::Vec3w(32768, 32768, 65535));
    EXPECT_EQ(png(0, 3), cv::Vec3w(0, 0, 0));
}

TEST_F(MapFiles, EightBitNormalsFromElsewhereAreReadInsideAMask) {
    const NormalMap normals = ball_normals(33);
    cv::Mat3b image;
    cv::Mat(normals.normal * 127.5 + cv::Scalar::all(127.5)).convertTo(image, CV_8U);
    write_png(at("n8.png"), image);
    cv::Mat1b mask(33, 33, uchar{0});
    mask(cv::Rect(10, 10, 12, 12)) = 255;
    const NormalMap read = read_normal_map(at("n8.png"), mask);
    EXPECT_EQ(cv::countNonZero(read.valid), 144);
    EXPECT_LT(cv::norm(read.normal(12, 12) - normals.normal(12, 12)), 0.012);
    EXPECT_THAT(input_error_of([&] { read_normal_map(at("n8.png"), cv::Mat1b(3, 3)); }), HasSubstr("3x3"));
}

TEST_F(MapFiles, APictureWithoutNormalsIsRefused) {
    write_png(at("black.png"), cv::Mat(4, 4, CV_8UC3, cv::Scalar::all(0)));
    EXPECT_THAT(input_error_of([&] { read_normal_map(at("black.png")); }), HasSubstr("holds no normals"));
}

TEST_F(MapFiles, IndexAndCoordinatesComeBackExactly) {
    IndexMap index{cv::Mat1w(4, 5, ushort{0}), 300};
    index.label(2, 3) = 300;
    index.label(1, 1) = 7;
    write_index_map(at("index.png"), index);
    const IndexMap read = read_index_map(at("index.png"));
    EXPECT_EQ(read.texels, 300);
    EXPECT_EQ(cv::norm(read.label, index.label, cv::NORM_INF), 0);

    cv::Mat2i coordinates(4, 5, cv::Vec2i(-1, -1));
    coordinates(1, 2) = {0, 0};
    coordinates(3, 4) = {4095, 17};
    write_coordinates(at("coordinates.png"), coordinates);
    EXPECT_EQ(cv::norm(read_coordinates(at("coordinates.png")), coordinates, cv::NORM_INF), 0);
    EXPECT_EQ(cv::Mat3w(read_png(at("coordinates.png")))(3, 4), cv::Vec3w(4095, 17, 65535));
    EXPECT_THAT(input_error_of([&] { read_index_map(at("coordinates.png")); }), HasSubstr("16-bit PNG with 1 channel"));
}

TEST_F(MapFiles, AlbedoKeepsItsScaleInExrAndIsSrgbInPng) {
    AlbedoMap albedo{cv::Mat3f(2, 2, cv::Vec3f(0.5F, 2.0F, 0.0F)), cv::Mat1b(2, 2, uchar{255})};
    albedo.valid(0, 0) = 0;
    write_albedo_map(at("a.exr"), albedo);
    const AlbedoMap read = read_albedo_map(at("a.exr"));
    EXPECT_EQ(read.albedo(1, 1), cv::Vec3f(0.5F, 2.0F, 0.0F));
    EXPECT_EQ(read.valid(0, 0), 0);
    write_albedo_map(at("a.png"), albedo);
    EXPECT_EQ(cv::Mat3b(read_png(at("a.png")))(1, 1), cv::Vec3b(188, 255, 0));
    EXPECT_NEAR(read_albedo_map(at("a.png")).albedo(1, 1)[0], 0.5, 0.004);
}

TEST_F(MapFiles, ShadingMapsComeBack) {
    ShadingMaps maps{2, 3, cv::Mat3f(2, 3), cv::Mat1i(2, 3), cv::Mat3f(2, 1)};
    cv::randu(maps.radiance, 0, 2);
    cv::randu(maps.samples, 0, 1000);
    cv::randu(maps.mean_albedo, 0, 1);
    write_shading_maps(at("s.exr"), at("s.json"), maps);
    const ShadingMaps read = read_shading_maps(at("s.exr"), at("s.json"));
    EXPECT_EQ(cv::norm(read.radiance, maps.radiance, cv::NORM_INF), 0);
    EXPECT_EQ(cv::norm(read.samples, maps.samples, cv::NORM_INF), 0);
    EXPECT_EQ(cv::norm(read.mean_albedo, maps.mean_albedo, cv::NORM_INF), 0);
    write_exr(at("s.exr"), cv::Mat3f(5, 3, cv::Vec3f(0, 0, 0)));
    EXPECT_THAT(input_error_of([&] { read_shading_maps(at("s.exr"), at("s.json")); }), HasSubstr("2 texels"));
}

TEST(Srgb, RoundTripAndKnownValues) {
    EXPECT_NEAR(linear_from_srgb(0.5F), 0.21404114F, 1e-6);
    for (float v = 0; v <= 1; v += 0.01F) EXPECT_NEAR(srgb_from_linear(linear_from_srgb(v)), v, 2e-6);
}

TEST(NormalTruth, OfTheRealBallIsABall) {
    DARKBOX_NEED_DATA(data, "diligent_ball");
    const NormalMap truth = read_normal_truth(data / "Normal_gt.mat");
    ASSERT_EQ(truth.normal.size(), cv::Size(612, 512));
    const cv::Rect box = cv::boundingRect(truth.valid);
    EXPECT_NEAR(box.width, box.height, 2);
    const cv::Point middle(box.x + box.width / 2, box.y + box.height / 2);
    EXPECT_GT(truth.normal(middle)[2], 0.999) << "the middle faces the camera";
    EXPECT_GT(truth.normal(box.y + 2, middle.x)[1], 0.9) << "the top faces up";
    EXPECT_GT(truth.normal(middle.y, box.br().x - 3)[0], 0.9) << "the right side faces right";
}

}  // namespace
}  // namespace darkbox
