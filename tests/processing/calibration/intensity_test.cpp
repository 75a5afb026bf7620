#include "processing/calibration/intensity.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "tests/processing/calibration/drift_scene.h"
#include "tests/support/throws.h"

namespace darkbox {
namespace {

using testing::HasSubstr;

/// A grey card that fills the picture from (10, 10) to (30, 25), under each light.
struct CardScene {
    std::vector<cv::Mat3f> frames;
    std::vector<cv::Mat1b> clipped;
    Lights lights;
    GreyCard card;
};

CardScene card_under(const Lights& lights, const GreyCard& card) {
    CardScene scene{{}, {}, lights, card};
    for (Light& light : scene.lights) light.intensity.setOnes();
    for (const Light& light : lights) {
        cv::Mat3f frame(40, 60, cv::Vec3f(0, 0, 0));
        for (int y = card.area.y; y < card.area.y + card.area.height; ++y)
            for (int x = card.area.x; x < card.area.x + card.area.width; ++x) {
                Incidence at{light.direction, 1};
                if (card.view) at = incidence(light, card.view->point_at(cv::Point2d(x, y)));
                for (int c = 0; c < 3; ++c)
                    frame(y, x)[c] = static_cast<float>(0.18 * light.intensity[c] * at.falloff *
                                                        std::max(0.0, card.normal.dot(at.direction)));
            }
        scene.frames.push_back(frame);
        scene.clipped.emplace_back(frame.size(), uchar{0});
    }
    return scene;
}

Lights uneven_dome(int count) {
    Lights lights = test::dome(count).lights;
    for (std::size_t i = 0; i < lights.size(); ++i)
        lights[i].intensity = {0.5 + 0.1 * static_cast<double>(i), 1.0, 1.5 - 0.1 * static_cast<double>(i)};
    return with_mean_intensity_one(lights);
}

void expect_intensities(const Lights& found, const Lights& truth) {
    for (std::size_t i = 0; i < truth.size(); ++i)
        EXPECT_NEAR((found[i].intensity - truth[i].intensity).norm(), 0, 1e-5) << i;
}

GreyCard card_at(cv::Rect area) {
    GreyCard card;
    card.area = area;
    return card;
}

TEST(GreyCard, TellsIntensitiesOfDistantLights) {
    const Lights truth = uneven_dome(9);
    const CardScene scene = card_under(truth, card_at({10, 10, 20, 15}));
    expect_intensities(with_intensities_of_card(scene.frames, scene.clipped, scene.lights, scene.card), truth);
}

TEST(GreyCard, MayLieAslant) {
    const Lights truth = uneven_dome(9);
    GreyCard card = card_at({10, 10, 20, 15});
    card.normal = Eigen::Vector3d(0.2, -0.1, 1).normalized();
    const CardScene scene = card_under(truth, card);
    expect_intensities(with_intensities_of_card(scene.frames, scene.clipped, scene.lights, card), truth);
}

TEST(GreyCard, DividesTheFallOffOfNearLightsOut) {
    Lights truth = uneven_dome(9);
    for (Light& light : truth) light.near = LampPosition{400 * light.direction, {0, 0, 0}};
    GreyCard card = card_at({10, 10, 20, 15});
    card.view = ViewGeometry{3.0, {30, 20}};
    const CardScene scene = card_under(truth, card);
    expect_intensities(with_intensities_of_card(scene.frames, scene.clipped, scene.lights, card), truth);
}

TEST(GreyCard, MayHaveAnyOutline) {
    const Lights truth = uneven_dome(9);
    CardScene scene = card_under(truth, card_at({10, 10, 20, 15}));
    GreyCard card;
    card.mask = cv::Mat1b(40, 60, uchar{0});
    cv::circle(*card.mask, {20, 17}, 6, cv::Scalar(255), cv::FILLED);
    for (cv::Mat3f& frame : scene.frames) frame(cv::Rect(10, 10, 3, 3)).setTo(cv::Scalar(1, 1, 1));  // beside it
    expect_intensities(with_intensities_of_card(scene.frames, scene.clipped, scene.lights, card), truth);
    card.mask = cv::Mat1b(41, 60, uchar{255});
    EXPECT_THAT(
        test::input_error_of([&] { with_intensities_of_card(scene.frames, scene.clipped, scene.lights, card); }),
        HasSubstr("mask is 60x41"));
}

TEST(GreyCard, WhatItCannotTellIsAnError) {
    CardScene scene = card_under(uneven_dome(9), card_at({10, 10, 20, 15}));
    const auto read = [&](const GreyCard& card) {
        return with_intensities_of_card(scene.frames, scene.clipped, scene.lights, card);
    };
    EXPECT_THAT(test::input_error_of([&] { read(card_at({50, 10, 20, 15})); }), HasSubstr("not inside the picture"));
    EXPECT_THAT(test::input_error_of([&] { read(card_at({40, 10, 10, 5})); }), HasSubstr("dark in frame-1.png"));
    GreyCard turned = scene.card;
    turned.normal = Eigen::Vector3d(0, 0, -1);
    EXPECT_THAT(test::input_error_of([&] { read(turned); }), HasSubstr("hardly reaches"));
    scene.clipped[2].setTo(255);
    EXPECT_THAT(test::input_error_of([&] { read(scene.card); }), HasSubstr("clipped in frame-3.png"));
}

TEST(Intensities, SpreadIsToldAboveOneAndAHalf) {
    Lights lights = test::dome(4).lights;
    lights[1].intensity = {1, 1.4, 1};
    EXPECT_FALSE(spread_in_words(lights));
    lights[1].intensity = {1, 2, 1};
    EXPECT_DOUBLE_EQ(intensity_spread(lights), 2);
    EXPECT_THAT(spread_in_words(lights).value(), HasSubstr("2 times"));
}

TEST(Intensities, NamesOfOriginsReadBack) {
    for (const auto origin : {IntensityOrigin::unknown, IntensityOrigin::given, IntensityOrigin::grey_card,
                              IntensityOrigin::flat, IntensityOrigin::estimated})
        EXPECT_EQ(intensity_origin_from_name(name(origin)), origin);
    EXPECT_FALSE(intensity_origin_from_name("guessed"));
}

}  // namespace
}  // namespace darkbox
