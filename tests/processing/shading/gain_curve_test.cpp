#include "processing/shading/gain_curve.h"

#include <gtest/gtest.h>

namespace darkbox {
namespace {

const cv::Vec3d grey(0.5, 0.5, 0.5);

/// `count` samples evenly over [from, to] of a surface that is `gain` times as bright as Lambert's.
void add_even(GainEstimator& estimator, double from, double to, int count, double gain) {
    for (int i = 0; i < count; ++i) {
        const double r = from + (to - from) * (i + 0.5) / count;
        estimator.add(r, grey, gain * r * grey);
    }
}

TEST(GainCurve, OfLambertIsOne) {
    GainEstimator estimator(11);
    add_even(estimator, 0, 1, 400, 1.0);
    for (const cv::Vec3d& gain : estimator.curve().gain) EXPECT_NEAR(gain[1], 1.0, 1e-12);
}

TEST(GainCurve, OfMixedAlbedoLitUnevenlyIsStillOne) {
    GainEstimator estimator(11);
    for (int i = 1; i <= 300; ++i) {
        const double r = i / 300.0;
        const cv::Vec3d albedo = r < 0.5 ? cv::Vec3d(0.1, 0.2, 0.3) : cv::Vec3d(0.9, 0.5, 0.4);
        estimator.add(r, albedo, r * albedo);
    }
    for (const cv::Vec3d& gain : estimator.curve().gain)
        for (int c = 0; c < 3; ++c) EXPECT_NEAR(gain[c], 1.0, 1e-12);
}

TEST(GainCurve, FollowsABrdfThatIsNotLambert) {
    GainEstimator estimator(11);
    for (int i = 1; i <= 2000; ++i) {
        const double r = i / 2000.0;
        estimator.add(r, grey, r * (0.5 + r) * grey);
    }
    const GainCurve curve = estimator.curve();
    for (int level = 1; level < 10; ++level) EXPECT_NEAR(curve.gain[level][0], 0.5 + 0.1 * level, 0.05);
}

TEST(GainCurve, LeavesShadowsOutWhileEnoughIsLit) {
    GainEstimator estimator(11);
    add_even(estimator, 0, 1, 400, 1.0);
    add_even(estimator, 0, 1, 800, 0.1);
    for (const cv::Vec3d& gain : estimator.curve().gain) EXPECT_NEAR(gain[2], 1.0, 1e-12);
}

TEST(GainCurve, KeepsWhatIsDarkThroughout) {
    GainEstimator estimator(11);
    add_even(estimator, 0, 1, 400, 0.2);
    for (const cv::Vec3d& gain : estimator.curve().gain) EXPECT_NEAR(gain[0], 0.2, 1e-12);
}

TEST(GainCurve, BridgesALevelThatLiesInShadow) {
    GainEstimator estimator(11);
    add_even(estimator, 0.4, 1, 400, 0.9);
    add_even(estimator, 0, 0.4, 400, 0.1);
    for (const cv::Vec3d& gain : estimator.curve().gain) EXPECT_NEAR(gain[1], 0.9, 1e-12);
}

TEST(GainCurve, BridgesAGapAndHoldsBeyondTheLastSample) {
    GainEstimator estimator(11);
    add_even(estimator, 0.19, 0.21, 500, 1.2);
    add_even(estimator, 0.595, 0.605, 500, 0.8);
    const GainCurve curve = estimator.curve();
    // Neighbours are tied by one sample of five hundred: it shows in the third decimal.
    EXPECT_NEAR(curve.gain[1][0], 1.2, 0.01);
    EXPECT_NEAR(curve.gain[4][0], 1.0, 0.01);
    EXPECT_NEAR(curve.gain[10][0], 0.8, 0.01);
    EXPECT_EQ(curve.samples[4], 0);
    EXPECT_EQ(curve.samples[10], 0);
    EXPECT_EQ(curve.samples[2], 500);
}

TEST(GainCurve, WithoutSamplesIsLambert) {
    const GainCurve curve = GainEstimator(5).curve();
    for (const cv::Vec3d& gain : curve.gain) EXPECT_EQ(gain, cv::Vec3d(1, 1, 1));
    EXPECT_EQ(curve.samples, std::vector<int>(5, 0));
}

TEST(GainCurve, IsNeverNegative) {
    GainEstimator estimator(3);
    for (int i = 0; i < 20; ++i) estimator.add(0.5, grey, {-0.01, 0.2, 0.2});
    EXPECT_EQ(estimator.curve().gain[1][0], 0.0);
}

}  // namespace
}  // namespace darkbox
