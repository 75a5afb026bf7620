#include "processing/formats/demosaic.h"

#include <gmock/gmock.h>

#include <array>
#include <opencv2/imgproc.hpp>

#include "acquisition/frame/error.h"

namespace darkbox {
namespace {

constexpr std::array mosaics{Mosaic{0, 0}, Mosaic{0, 1}, Mosaic{1, 0}, Mosaic{1, 1}};
constexpr int full = 4095;

/// 0, 1, 2 for red, green, blue.
int colour_at(Mosaic mosaic, int row, int column) {
    const bool red_row = row % 2 == mosaic.red_row, red_column = column % 2 == mosaic.red_column;
    if (red_row != red_column) return 1;
    return red_row ? 0 : 2;
}

cv::Mat1w sample(const cv::Mat3w& truth, Mosaic mosaic) {
    cv::Mat1w raw(truth.size());
    for (int y = 0; y < raw.rows; ++y)
        for (int x = 0; x < raw.cols; ++x) raw(y, x) = truth(y, x)[colour_at(mosaic, y, x)];
    return raw;
}

cv::Mat whole(const cv::Mat& raw, Mosaic mosaic, int full_scale = full) {
    cv::Mat tall;
    cv::copyMakeBorder(raw, tall, demosaic_margin, demosaic_margin, 0, 0, cv::BORDER_REFLECT_101);
    return demosaic(tall, 0, mosaic, full_scale);
}

void expect_same(const cv::Mat& a, const cv::Mat& b) {
    ASSERT_EQ(a.size(), b.size());
    ASSERT_EQ(a.type(), b.type());
    EXPECT_EQ(cv::norm(a, b, cv::NORM_INF), 0);
}

TEST(Demosaic, OneColourStaysOneColour) {
    for (const Mosaic mosaic : mosaics) {
        const cv::Mat3w truth(9, 11, cv::Vec3w(500, 1200, 77));
        expect_same(whole(sample(truth, mosaic), mosaic), truth);
    }
}

/// Planes of one gradient and other heights are exact inside; at the borders a mirrored plane is none.
TEST(Demosaic, SharedGradientsAreExact) {
    for (const Mosaic mosaic : mosaics) {
        cv::Mat3w truth(12, 14);
        for (int y = 0; y < truth.rows; ++y)
            for (int x = 0; x < truth.cols; ++x) {
                const int plane = 16 * x + 48 * y;
                truth(y, x) = cv::Vec3w(static_cast<ushort>(300 + plane), static_cast<ushort>(1000 + plane),
                                        static_cast<ushort>(64 + plane));
            }
        const cv::Rect inside(2, 2, truth.cols - 4, truth.rows - 4);
        expect_same(cv::Mat(whole(sample(truth, mosaic), mosaic), inside), cv::Mat(truth, inside));
    }
}

/// Figure 2 of the paper, in its own eighths: what a lone sample adds to each colour of each pixel around it.
TEST(Demosaic, ALoneSampleSpreadsAsInThePaper) {
    const Mosaic rggb{0, 0};
    constexpr int base = 1600, height = 160;
    const auto added = [&](cv::Point lone, int row, int column) {
        cv::Mat1w raw(13, 13, static_cast<ushort>(base));
        raw(lone) = static_cast<ushort>(base + height);
        const auto pixel = whole(raw, rggb).at<cv::Vec3w>(row, column);
        return cv::Vec3d(pixel) - cv::Vec3d::all(base);
    };
    const cv::Point red(6, 6), green(7, 6), blue(7, 7);  // x, y; green in a red row
    const double eighth = height / 8.0;
    EXPECT_EQ(added(red, 6, 6), cv::Vec3d(8, 4, 6) * eighth);
    EXPECT_EQ(added(red, 6, 7), cv::Vec3d(4, 0, 0) * eighth);  // red at green, in a red row
    EXPECT_EQ(added(red, 7, 6), cv::Vec3d(4, 0, 0) * eighth);
    EXPECT_EQ(added(red, 7, 7), cv::Vec3d(2, 0, 0) * eighth);  // red at blue
    EXPECT_EQ(added(red, 6, 8), cv::Vec3d(0, -1, -1.5) * eighth);
    EXPECT_EQ(added(red, 8, 6), cv::Vec3d(0, -1, -1.5) * eighth);
    EXPECT_EQ(added(green, 6, 7), cv::Vec3d(5, 8, 5) * eighth);
    EXPECT_EQ(added(green, 6, 6), cv::Vec3d(0, 2, 0) * eighth);
    EXPECT_EQ(added(green, 6, 9), cv::Vec3d(-1, 0, 0.5) * eighth);  // same row: along red, across blue
    EXPECT_EQ(added(green, 8, 7), cv::Vec3d(0.5, 0, -1) * eighth);
    EXPECT_EQ(added(green, 7, 8), cv::Vec3d(-1, 0, -1) * eighth);
    EXPECT_EQ(added(blue, 7, 7), cv::Vec3d(6, 4, 8) * eighth);
    EXPECT_EQ(added(blue, 8, 8), cv::Vec3d(0, 0, 2) * eighth);
}

TEST(Demosaic, BandsAreTheWhole) {
    cv::Mat1w raw(20, 15);
    cv::RNG random(5);
    random.fill(raw, cv::RNG::UNIFORM, 0, full);
    cv::Mat tall;
    cv::copyMakeBorder(raw, tall, demosaic_margin, demosaic_margin, 0, 0, cv::BORDER_REFLECT_101);
    for (const Mosaic mosaic : mosaics) {
        const cv::Mat all = whole(raw, mosaic);
        for (const auto& [first, count] : {std::pair{0, 3}, {3, 1}, {4, 16}})
            expect_same(demosaic(tall.rowRange(first, first + count + 2 * demosaic_margin), first, mosaic, full),
                        all.rowRange(first, first + count));
    }
}

TEST(Demosaic, EightBitsAreAsSixteen) {
    cv::Mat1b raw(16, 17);
    cv::RNG random(6);
    random.fill(raw, cv::RNG::UNIFORM, 0, 256);
    cv::Mat1w words;
    raw.convertTo(words, CV_16U);
    cv::Mat expected;
    whole(words, mosaics[1], 255).convertTo(expected, CV_8U);
    expect_same(whole(raw, mosaics[1], 255), expected);
}

TEST(Demosaic, WhatIsMadeOfClippedSamplesIsClipped) {
    cv::Mat1w raw(11, 11, ushort{1000});
    raw(5, 5) = full;  // a blue sample
    const cv::Mat3w rgb = whole(raw, {0, 0});
    EXPECT_EQ(rgb(5, 5), cv::Vec3w(full, full, full));
    EXPECT_EQ(rgb(5, 4), cv::Vec3w(1000, 1000, full));
    EXPECT_EQ(rgb(4, 4), cv::Vec3w(1000, 1000, full));
    EXPECT_EQ(rgb(5, 7), cv::Vec3w(full, full, 1000));
    EXPECT_EQ(rgb(3, 3), cv::Vec3w(1000, 1000, 1000));
}

TEST(Demosaic, TooSmallPicturesAreRefused) {
    EXPECT_THROW(demosaic(cv::Mat1w(5, 2), 0, {0, 0}, full), InputError);
    EXPECT_THROW(demosaic(cv::Mat1w(4, 5), 0, {0, 0}, full), InputError);
}

}  // namespace
}  // namespace darkbox
