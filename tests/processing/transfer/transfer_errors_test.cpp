#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "acquisition/frame/error.h"
#include "tests/processing/transfer/exemplars.h"

namespace darkbox {
namespace {

using test::plane_normals;
using test::stony_sphere;
using testing::HasSubstr;

constexpr float nan = std::numeric_limits<float>::quiet_NaN();

std::string refusal(const TransferSource& source, const NormalMap& target, const TransferOptions& options = {}) {
    try {
        transfer_texture(source, target, options);
    } catch (const InputError& error) {
        EXPECT_FALSE(error.hint().empty());
        return error.what();
    }
    return "accepted";
}

TEST(TransferOptions, NameTheFieldAndItsRange) {
    const auto refused = [](auto TransferOptions::* field, auto value) -> std::string {
        TransferOptions options;
        options.*field = value;
        try {
            options.validate();
        } catch (const InputError& error) {
            return error.what();
        }
        return "accepted";
    };
    EXPECT_THAT(refused(&TransferOptions::window, 1), HasSubstr("window is 1, but it must be 3...15"));
    EXPECT_THAT(refused(&TransferOptions::window, 6), HasSubstr("window is 6, but it must be odd"));
    EXPECT_THAT(refused(&TransferOptions::coarse_window, 17), HasSubstr("coarse_window is 17"));
    EXPECT_THAT(refused(&TransferOptions::levels, -1), HasSubstr("levels is -1, but it must be 0...12"));
    EXPECT_THAT(refused(&TransferOptions::kappa, 26.0), HasSubstr("kappa is 26"));
    EXPECT_THAT(refused(&TransferOptions::kappa, std::numeric_limits<double>::quiet_NaN()), HasSubstr("kappa is nan"));
    EXPECT_THAT(refused(&TransferOptions::normal_weight, -0.5), HasSubstr("normal_weight is -0.5"));
    EXPECT_THAT(refused(&TransferOptions::jitter, 1.5), HasSubstr("jitter is 1.5, but it must be 0...1"));
    EXPECT_THAT(refused(&TransferOptions::control_weight, -1.0), HasSubstr("control_weight is -1"));
    EXPECT_THAT(refused(&TransferOptions::normal_sigma, 65.0), HasSubstr("normal_sigma is 65"));
    EXPECT_EQ(refused(&TransferOptions::window, 15), "accepted");
}

TEST(TransferErrors, EmptySourceOrTarget) {
    TransferSource source = stony_sphere(32);
    NormalMap target = plane_normals({16, 16});
    target.valid = std::uint8_t{0};
    EXPECT_THAT(refusal(source, target), HasSubstr("the target has no valid pixel"));
    source.albedo.valid = cv::Mat1b(32, 32, std::uint8_t{0});
    EXPECT_THAT(refusal(source, plane_normals({16, 16})), HasSubstr("the source has no valid pixel"));
    EXPECT_THAT(refusal({}, {}), HasSubstr("no valid pixel"));
}

TEST(TransferErrors, MapsOfDifferentSizes) {
    TransferSource source = stony_sphere(32);
    source.albedo.albedo = cv::Mat3f(20, 32);
    EXPECT_THAT(refusal(source, plane_normals({16, 16})), HasSubstr("the source's albedo is 32x20"));
    source = stony_sphere(32);
    source.index.label = cv::Mat1w(5, 5);
    EXPECT_THAT(refusal(source, plane_normals({16, 16})), HasSubstr("index map is 5x5"));
    NormalMap target = plane_normals({16, 16});
    target.valid = cv::Mat1b(8, 8, std::uint8_t{255});
    EXPECT_THAT(refusal(stony_sphere(32), target), HasSubstr("the target's mask is 8x8"));
}

TEST(TransferErrors, ValuesThatAreNotNumbers) {
    NormalMap target = plane_normals({16, 16});
    target.normal(3, 2) = cv::Vec3f(nan, 0, 1);
    EXPECT_THAT(refusal(stony_sphere(32), target), HasSubstr("the target's normal at (2, 3)"));
    TransferSource source = stony_sphere(32);
    source.normals.normal(16, 15) = cv::Vec3f(0, 0, 0);
    EXPECT_THAT(refusal(source, plane_normals({16, 16})), HasSubstr("the source's normal at (15, 16)"));
    source = stony_sphere(32);
    source.albedo.albedo(16, 15)[1] = nan;
    EXPECT_THAT(refusal(source, plane_normals({16, 16})), HasSubstr("the source's albedo at (15, 16)"));
}

TEST(TransferErrors, WhatLiesOutsideTheMaskMayBeAnything) {
    TransferSource source = stony_sphere(32);
    source.normals.normal(0, 0) = cv::Vec3f(nan, nan, nan);
    source.albedo.albedo(0, 0) = cv::Vec3f(nan, nan, nan);
    NormalMap target = plane_normals({16, 16});
    target.valid(0, 0) = 0;
    target.normal(0, 0) = cv::Vec3f(nan, nan, nan);
    const TransferResult result = transfer_texture(source, target);
    for (const cv::Vec3f& v : result.albedo.albedo) EXPECT_TRUE(std::isfinite(v[0] + v[1] + v[2]));
}

TEST(TransferErrors, CancellingStopsTheWork) {
    std::stop_source stop;
    std::size_t rows = 0;
    WorkContext work;
    work.stop = stop.get_token();
    work.report = [&](const ProgressUpdate& update) {
        rows = update.done;
        if (rows >= 5) stop.request_stop();
    };
    EXPECT_THROW(transfer_texture(stony_sphere(64), plane_normals({64, 64}), test::by(TransferMethod::analogies), work),
                 Cancelled);
    EXPECT_LT(rows, 10U);
}

}  // namespace
}  // namespace darkbox
