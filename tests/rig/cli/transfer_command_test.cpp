#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "processing/formats/exr.h"
#include "processing/formats/map_files.h"
#include "processing/formats/png.h"
#include "tests/rig/cli/program.h"
#include "tests/support/test_data.h"

namespace darkbox {
namespace {

using test::darkbox_program;
using testing::HasSubstr;

constexpr int side = 48;

/// Plain maps of a bumpy source that tells each pixel's place by its colour, and of a tilted plane as the target.
class TransferCommand : public testing::Test {
protected:
    test::TemporaryFolder folder_;
    cv::Mat3w places_ = cv::Mat3w(side, side);

    std::string at(const std::string& name) const { return (folder_.path() / name).string(); }

    void SetUp() override {
        NormalMap source{cv::Mat3f(side, side), cv::Mat1b(side, side, std::uint8_t{255})};
        NormalMap target = {cv::Mat3f(side, side), source.valid.clone()};
        AlbedoMap albedo{cv::Mat3f(side, side), source.valid.clone()};
        cv::Mat1f radiance(side, side);
        for (int y = 0; y < side; ++y)
            for (int x = 0; x < side; ++x) {
                const cv::Vec3d bumpy(0.2 * std::sin(x * 1.7), 0.2 * std::cos(y * 1.9), 1);
                source.normal(y, x) = bumpy / cv::norm(bumpy);
                target.normal(y, x) = cv::Vec3f(0.28F, 0, 0.96F);
                albedo.albedo(y, x) = {0.2F + 0.01F * static_cast<float>(x % 16), 0.5F, 0.3F};
                places_(y, x) = {static_cast<ushort>(257 * x), static_cast<ushort>(1000 + y), 7};
                radiance(y, x) = 1000.5F * static_cast<float>(x) + static_cast<float>(y);
            }
        write_normal_map(at("source.exr"), source);
        write_normal_map(at("target.exr"), target);
        write_albedo_map(at("albedo.exr"), albedo);
        write_png(at("places.png"), places_);
        write_exr(at("radiance.exr"), {{"L", radiance}});
    }

    test::ProgramResult transfer(std::vector<std::string> more) const {
        std::vector<std::string> arguments{
            "transfer", "--source-normals", at("source.exr"), "--source-albedo", at("albedo.exr"),
            "--target", at("target.exr"),   "--out",          at("out"),         "--json"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return darkbox_program(arguments);
    }
};

TEST_F(TransferCommand, CarriesAnyMapOverInItsOwnFormat) {
    for (const std::string method : {"preview", "patchmatch", "analogies"}) {
        const auto r = transfer({"--method", method, "--apply", at("places.png"), at("radiance.exr")});
        ASSERT_EQ(r.status, 0) << r.err;
        EXPECT_EQ(nlohmann::json::parse(r.out)["applied"].size(), 2U);
        const cv::Mat2i coordinates = read_coordinates(at("out/coordinates.png"));
        const cv::Mat places = read_png(at("out/applied-places.png"));
        ASSERT_EQ(places.type(), CV_16UC3);
        const cv::Mat1f radiance = read_exr_channel(at("out/applied-radiance.exr"), "L");
        for (int y = 0; y < side; ++y)
            for (int x = 0; x < side; ++x) {
                const cv::Vec2i& from = coordinates(y, x);
                ASSERT_GE(from[0], 0);
                EXPECT_EQ(places.at<cv::Vec3w>(y, x), places_(from[1], from[0]));
                EXPECT_EQ(radiance(y, x), 1000.5F * static_cast<float>(from[0]) + static_cast<float>(from[1]));
            }
    }
}

TEST_F(TransferCommand, WritesNormalsWithTheReliefAndWhereTheSourceFallsShort) {
    ASSERT_EQ(transfer({"--sigma", "4"}).status, 0);
    const NormalMap normals = read_normal_map(at("out/normals.exr"));
    double mean_tilt = 0;
    double spread = 0;
    for (const cv::Vec3f& n : normals.normal) {
        mean_tilt += n[0] / (side * side);
        spread += (n[0] - 0.28) * (n[0] - 0.28) / (side * side);
    }
    EXPECT_NEAR(mean_tilt, 0.28, 0.03);
    EXPECT_GT(std::sqrt(spread), 0.08);  // the ripples' own is 0.2 / sqrt(2)
    EXPECT_EQ(read_exr_channel(at("out/uncovered.exr"), "Y").size(), cv::Size(side, side));
    EXPECT_EQ(read_png(at("out/normals.png")).type(), CV_16UC3);
}

TEST_F(TransferCommand, RefusesWhatDoesNotFit) {
    write_png(at("small.png"), cv::Mat1b(5, 7, uchar{1}));
    EXPECT_THAT(transfer({"--apply", at("small.png")}).err, HasSubstr("is 7x5, but the source is 48x48"));
    EXPECT_THAT(transfer({"--apply", at("places.png"), at("places.png")}).err, HasSubstr("two maps to apply"));
    EXPECT_THAT(transfer({"--apply", at("nothing.png")}).err, HasSubstr("nothing.png"));
    EXPECT_THAT(transfer({"--control-source", at("places.png")}).err, HasSubstr("two sides"));
    EXPECT_THAT(transfer({"--control-source", at("places.png"), "--control-target", at("small.png")}).err,
                HasSubstr("control map is 7x5"));
    EXPECT_EQ(transfer({"--method", "magic"}).status, 2);
    EXPECT_THAT(transfer({"--jitter", "2"}).err, HasSubstr("jitter is 2"));
}

}  // namespace
}  // namespace darkbox
