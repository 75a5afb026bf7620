#include "processing/relight/ptm.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "acquisition/frame/error.h"
#include "tests/support/throws.h"

namespace darkbox {
namespace {

using test::input_error_of;
using testing::HasSubstr;

Lights dome() {
    Lights lights(12);
    for (int i = 0; i < 12; ++i) {
        const double turn = i * std::numbers::pi / 3 + 0.2, out = i < 6 ? 0.35 : 0.75;
        lights[static_cast<std::size_t>(i)].direction = {out * std::cos(turn), out * std::sin(turn),
                                                         std::sqrt(1 - out * out)};
    }
    return lights;
}

/// A picture whose samples are a polynomial of the light: nothing is left for a fit to miss.
cv::Mat3f polynomial(const Eigen::Vector3d& l, bool one_colour) {
    cv::Mat3f image(5, 7);
    for (int y = 0; y < 5; ++y)
        for (int x = 0; x < 7; ++x)
            for (int c = 0; c < 3; ++c) {
                const int k = one_colour ? 0 : c;
                const double value = 0.5 + 0.03 * x + (0.1 + 0.02 * k) * l.x() - 0.05 * (y - 2) * l.y() -
                                     0.2 * l.x() * l.x() + 0.04 * k * l.x() * l.y() - 0.1 * l.y() * l.y();
                image(y, x)[c] = static_cast<float>(value * (one_colour ? 0.3 + 0.35 * c : 1.0));
            }
    return image;
}

PhotoStack stack_under(const Lights& lights, bool one_colour) {
    PhotoStack stack;
    stack.mask = cv::Mat1b(5, 7, uchar{255});
    for (const Light& light : lights) {
        cv::Mat3f image;
        cv::multiply(polynomial(light.direction, one_colour),
                     cv::Scalar(light.intensity[0], light.intensity[1], light.intensity[2]), image);
        stack.images.push_back(image);
        stack.clipped.emplace_back(5, 7, uchar{0});
        stack.files.push_back(light.file);
    }
    return stack;
}

const Eigen::Vector3d unseen = Eigen::Vector3d(0.3, -0.4, 0.8).normalized();

TEST(Ptm, APolynomialIsFittedExactly) {
    const Ptm ptm = fit_ptm(stack_under(dome(), false), dome());
    EXPECT_LT(cv::norm(evaluate(ptm, unseen), polynomial(unseen, false), cv::NORM_INF), 2e-6);
}

TEST(Ptm, OneColourTimesLuminanceIsFittedExactly) {
    const Ptm ptm = fit_ptm(stack_under(dome(), true), dome(), PtmModel::lrgb);
    EXPECT_EQ(ptm.colour(2, 3)[2], 1.0F);
    EXPECT_LT(cv::norm(evaluate(ptm, unseen), polynomial(unseen, true), cv::NORM_INF), 2e-6);
}

TEST(Ptm, IntensitiesAreDividedOutAndUnusedLightsLeftOut) {
    Lights lights = dome();
    for (std::size_t i = 0; i < lights.size(); ++i)
        lights[i].intensity = {1.0 + 0.05 * static_cast<double>(i), 0.7, 2.0};
    PhotoStack stack = stack_under(lights, false);
    lights[3].used = false;
    stack.images[3].setTo(cv::Scalar::all(9));
    EXPECT_LT(cv::norm(evaluate(fit_ptm(stack, lights), unseen), polynomial(unseen, false), cv::NORM_INF), 5e-6);
}

TEST(Ptm, LightsThatDoNotSufficeAreSaidSo) {
    Lights five = dome();
    five.resize(5);
    EXPECT_THAT(input_error_of([&] { fit_ptm(stack_under(five, false), five); }), HasSubstr("at least six lights"));
    Lights ring = dome();
    ring.resize(6);
    EXPECT_THAT(input_error_of([&] { fit_ptm(stack_under(ring, false), ring); }), HasSubstr("tell the six terms"));
    EXPECT_THAT(input_error_of([&] { fit_ptm(stack_under(dome(), false), ring); }), HasSubstr("12 photographs"));
}

TEST(Ptm, TheSameBitsOnAnyNumberOfThreads) {
    const PhotoStack stack = stack_under(dome(), false);
    const Ptm one = fit_ptm(stack, dome(), PtmModel::rgb, {.report = {}, .stop = {}, .threads = 1});
    const Ptm many = fit_ptm(stack, dome(), PtmModel::rgb, {.report = {}, .stop = {}, .threads = 4});
    for (std::size_t t = 0; t < ptm_terms; ++t)
        EXPECT_EQ(cv::norm(one.coefficient[t], many.coefficient[t], cv::NORM_INF), 0);
}

}  // namespace
}  // namespace darkbox
