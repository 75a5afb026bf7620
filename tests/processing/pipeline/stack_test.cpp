#include "processing/pipeline/stack.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <opencv2/imgproc.hpp>

#include "acquisition/session/session_writer.h"
#include "tests/processing/pipeline/synthetic_photographs.h"
#include "tests/support/test_data.h"
#include "tests/support/throws.h"

namespace darkbox {
namespace {

/// A 12-bit grey frame whose left half holds `left` and whose right half holds `right`, in sample units.
Frame grey_frame(std::uint16_t left, std::uint16_t right) {
    Frame frame;
    frame.width = 40;
    frame.height = 30;
    frame.format = PixelFormat::grey16;
    frame.bit_depth = 12;
    frame.black_level = 64;
    frame.controls.exposure = Seconds(0.01);
    frame.pixels.resize(40 * 30 * 2);
    for (std::size_t i = 0; i < 40 * 30; ++i) std::memcpy(frame.pixels.data() + 2 * i, i % 40 < 20 ? &left : &right, 2);
    return frame;
}

FrameRecord record_of(FrameKind kind) {
    FrameRecord record;
    record.kind = kind;
    record.bit_depth = 12;
    record.black_level = 64;
    if (kind == FrameKind::lit) record.lamp = LampId{0};
    return record;
}

TEST(LoadStack, SubtractsTheMeanLampsOffFrameAndScalesToFullScale) {
    test::TemporaryFolder folder;
    SessionWriter writer = SessionWriter::create(folder.path() / "s", SessionInfo{});
    writer.add(grey_frame(100, 100), record_of(FrameKind::dark));
    writer.add(grey_frame(2000, 4095), record_of(FrameKind::lit));
    writer.add(grey_frame(104, 104), record_of(FrameKind::dark));
    const PhotoStack stack = load_stack(writer.seal());
    ASSERT_EQ(stack.images.size(), 1u);
    EXPECT_NEAR(stack.images[0](5, 5)[1], (2000.0 - 102.0) / (4095.0 - 64.0), 1e-6);
    EXPECT_EQ(stack.clipped[0](5, 5), 0);
    EXPECT_EQ(stack.clipped[0](5, 35), 255);
}

TEST(LoadStack, WithoutALampsOffFrameTheBlackLevelIsSubtracted) {
    test::TemporaryFolder folder;
    SessionWriter writer = SessionWriter::create(folder.path() / "s", SessionInfo{});
    writer.add(grey_frame(64, 2000), record_of(FrameKind::lit));
    const PhotoStack stack = load_stack(writer.seal());
    EXPECT_NEAR(stack.images[0](5, 5)[0], 0.0, 1e-6);
    EXPECT_NEAR(stack.images[0](5, 35)[0], 1936.0 / 4031.0, 1e-6);
}

/// Read in bands, so that a mosaic whose phase were lost between two of them would show.
TEST(LoadStack, MosaicsBecomeColours) {
    test::TemporaryFolder folder;
    SessionWriter writer = SessionWriter::create(folder.path() / "s", SessionInfo{});
    Frame frame = grey_frame(0, 0);
    frame.format = PixelFormat::gbrg16;
    frame.height = 151;
    frame.pixels.clear();
    for (int y = 0; y < frame.height; ++y)
        for (int x = 0; x < frame.width; ++x) {
            const std::uint16_t sample = y % 2 == x % 2 ? 1000 : (y % 2 == 1 ? 2000 : 500);
            frame.pixels.push_back(static_cast<std::byte>(sample & 255));
            frame.pixels.push_back(static_cast<std::byte>(sample >> 8));
        }
    writer.add(frame, record_of(FrameKind::lit));
    const PhotoStack stack = load_stack(writer.seal());
    const double scale = 1.0 / (4095.0 - 64.0);
    const cv::Vec3d expected((2000 - 64) * scale, (1000 - 64) * scale, (500 - 64) * scale);
    double worst = 0;
    for (const cv::Vec3f& pixel : stack.images[0])
        worst = std::max(worst, cv::norm(cv::Vec3d(pixel) - expected, cv::NORM_INF));
    EXPECT_LT(worst, 1e-6);
}

TEST(LoadStack, ALampsOffFrameOfAnotherExposureIsNotTaken) {
    test::TemporaryFolder folder;
    SessionWriter writer = SessionWriter::create(folder.path() / "s", SessionInfo{});
    Frame other = grey_frame(500, 500);
    other.controls.exposure = Seconds(0.02);
    writer.add(other, record_of(FrameKind::dark));
    writer.add(grey_frame(64, 2000), record_of(FrameKind::lit));
    EXPECT_NEAR(load_stack(writer.seal()).images[0](5, 5)[0], 0.0, 1e-6);
}

TEST(AutomaticMask, IsTheBallWithoutTheMirrorBallBesideIt) {
    std::vector<cv::Mat3f> images;
    for (const Light& light : test::lamp_ring()) {
        cv::Mat3f image = test::lambert_ball(light);
        image += cv::Scalar::all(0.003);
        cv::circle(image, {88, 8}, 6, cv::Scalar(0.9, 0.9, 0.9), cv::FILLED);
        images.push_back(image);
    }
    const cv::Mat1b truth = test::lambert_ball_mask(), mask = automatic_mask(images, {{88, 8, 6}});
    cv::Mat1b both;
    cv::bitwise_and(mask, truth, both);
    EXPECT_GT(cv::countNonZero(both), 0.97 * cv::countNonZero(truth));
    EXPECT_LT(cv::countNonZero(mask) - cv::countNonZero(both), 0.01 * cv::countNonZero(truth));
}

TEST(AutomaticMask, DarkSpotsBelongToTheObjectButAHoleDoesNot) {
    cv::Mat3f image(100, 100, cv::Vec3f(0.003F, 0.003F, 0.003F));
    cv::circle(image, {50, 50}, 40, cv::Scalar(0.5, 0.5, 0.5), cv::FILLED);
    cv::circle(image, {50, 50}, 15, cv::Scalar(0.003, 0.003, 0.003), cv::FILLED);
    cv::circle(image, {80, 50}, 2, cv::Scalar(0.003, 0.003, 0.003), cv::FILLED);
    const cv::Mat1b mask = automatic_mask({image}, {});
    EXPECT_EQ(mask(50, 50), 0);
    EXPECT_EQ(mask(50, 80), 255);
    EXPECT_EQ(mask(50, 22), 255);
    EXPECT_EQ(mask(5, 5), 0);
}

TEST(AutomaticMask, NothingLitIsAnError) {
    const std::vector<cv::Mat3f> black(3, cv::Mat3f(20, 20, cv::Vec3f(0, 0, 0)));
    EXPECT_THAT(test::input_error_of([&] { automatic_mask(black, {}); }), testing::HasSubstr("no object"));
}

}  // namespace
}  // namespace darkbox
