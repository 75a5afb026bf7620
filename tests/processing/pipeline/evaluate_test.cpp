#include "processing/pipeline/evaluate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <random>

#include "processing/formats/light_files.h"
#include "processing/formats/png.h"
#include "processing/pipeline/ideal_sphere.h"
#include "processing/pipeline/import.h"
#include "processing/pipeline/paired_bootstrap.h"
#include "processing/pipeline/stages.h"
#include "tests/processing/pipeline/synthetic_photographs.h"
#include "tests/support/test_data.h"
#include "tests/support/textured_sphere.h"
#include "tests/support/throws.h"

namespace darkbox {
namespace {

using testing::HasSubstr;

NormalMap turned_about_x(const NormalMap& normals, double degrees) {
    NormalMap turned{normals.normal.clone(), normals.valid.clone()};
    const double a = degrees * std::numbers::pi / 180;
    for (cv::Vec3f& n : turned.normal)
        n = cv::Vec3d(n[0], n[1] * std::cos(a) - n[2] * std::sin(a), n[1] * std::sin(a) + n[2] * std::cos(a));
    return turned;
}

TEST(AngularErrors, AreThoseOfAKnownTurn) {
    const test::TexturedSphere scene = test::textured_sphere(64);
    // A turn moves a normal by its angle times the sine of its angle to the axis; on the axis it does not move at all.
    NormalMap across = scene.normals;
    for (int y = 0; y < 64; ++y)
        for (int x = 0; x < 64; ++x)
            if (std::abs(across.normal(y, x)[0]) > 0.02F) across.valid(y, x) = 0;
    const AngularError error = angular_error(turned_about_x(across, 3), across);
    EXPECT_NEAR(error.mean_deg, 3, 1e-3);
    EXPECT_NEAR(error.median_deg, 3, 1e-3);
    EXPECT_LE(error.max_deg, 3.0001);
    EXPECT_GT(error.count, 60u);
}

TEST(AngularErrors, MapsOfTwoSizesAreRefused) {
    const NormalMap small = test::textured_sphere(16).normals, large = test::textured_sphere(17).normals;
    EXPECT_THAT(test::input_error_of([&] { angular_error(small, large); }), HasSubstr("16 x 16"));
}

cv::Mat1b disc(double x, double y, double radius) {
    cv::Mat1b mask(120, 140, uchar{0});
    for (int v = 0; v < mask.rows; ++v)
        for (int u = 0; u < mask.cols; ++u)
            if (std::hypot(u - x, v - y) < radius) mask(v, u) = 255;
    return mask;
}

TEST(IdealSphere, IsTheOneInTheMask) {
    const IdealSphere sphere = ideal_sphere(disc(70.3, 55.8, 41.4));
    EXPECT_NEAR(sphere.outline.x, 70.3, 0.05);
    EXPECT_NEAR(sphere.outline.y, 55.8, 0.05);
    EXPECT_NEAR(sphere.outline.radius, 41.4, 0.1);
    const cv::Vec3f& n = sphere.normals.normal(30, 70);  // above the centre: y is up
    EXPECT_NEAR(n[1], (55.8 - 30) / 41.4, 0.003);
    EXPECT_NEAR(cv::norm(n), 1, 1e-6);
}

TEST(IdealSphere, MayBeCutByThePicturesBorder) {
    const IdealSphere sphere = ideal_sphere(disc(125.0, 60.2, 41.4));
    EXPECT_NEAR(sphere.outline.x, 125.0, 0.1);
    EXPECT_NEAR(sphere.outline.radius, 41.4, 0.1);
}

TEST(IdealSphere, ASquareIsNone) {
    cv::Mat1b square(100, 100, uchar{0});
    square(cv::Rect(20, 20, 60, 60)) = 255;
    EXPECT_THAT(test::input_error_of([&] { ideal_sphere(square); }), HasSubstr("no circle"));
    EXPECT_THAT(test::input_error_of([&] { ideal_sphere(cv::Mat1b(40, 40, uchar{255})); }), HasSubstr("no outline"));
}

TEST(PairedBootstrap, AConstantDifferenceIsCertain) {
    cv::Mat1d first(64, 64);
    cv::randu(first, 0, 10);
    const PairedBootstrap difference = paired_bootstrap(first, cv::Mat1d(first - 0.5));
    EXPECT_NEAR(difference.mean_difference, -0.5, 1e-12);
    EXPECT_NEAR(difference.low, -0.5, 1e-12);
    EXPECT_NEAR(difference.high, -0.5, 1e-12);
    EXPECT_EQ(difference.blocks, 4u);
    EXPECT_EQ(difference.pixels, 64u * 64u);
}

TEST(PairedBootstrap, LeavesOutWhatIsNotKnown) {
    cv::Mat1d first(64, 64, 1.0), second(64, 64, 2.0);
    second(cv::Rect(0, 0, 32, 32)) = std::nan("");
    const PairedBootstrap difference = paired_bootstrap(first, second);
    EXPECT_EQ(difference.pixels, 3072u);
    EXPECT_EQ(difference.blocks, 3u);
    EXPECT_DOUBLE_EQ(difference.mean_difference, 1);
}

/// Noise that neighbours share: about 4 pixels wide, well below a block.
cv::Mat1d smooth_noise(std::mt19937_64& engine, int side) {
    std::normal_distribution<double> normal;
    cv::Mat1d noise(side, side);
    for (double& value : noise) value = normal(engine);
    cv::Mat smooth;
    cv::GaussianBlur(noise, smooth, {0, 0}, 1);
    return smooth;
}

TEST(PairedBootstrap, CoversTheTrueDifferenceThoughNeighboursDepend) {
    std::mt19937_64 engine(7);
    PairedBootstrapOptions options;
    options.resamples = 400;
    options.block_px = 16;
    int covered = 0;
    constexpr int trials = 1000, side = 160;
    for (int trial = 0; trial < trials; ++trial) {
        const cv::Mat1d first(side, side, 0.0);
        const PairedBootstrap difference = paired_bootstrap(first, smooth_noise(engine, side), options);
        covered += difference.low <= 0 && 0 <= difference.high;
    }
    EXPECT_GE(covered, trials * 90 / 100);
    EXPECT_LE(covered, trials * 98 / 100);
}

TEST(PairedBootstrap, SaysWhichOptionIsWrong) {
    PairedBootstrapOptions options;
    options.block_px = 0;
    EXPECT_THAT(test::input_error_of([&] { options.validate(); }), HasSubstr("block_px is 0"));
}

class EvaluateSession : public testing::Test {
protected:
    /// The synthetic ball with its lights given, calibrated.
    Session calibrated() {
        const Lights lights = test::lamp_ring();
        test::write_photographs(folder_.path() / "photos", lights);
        cv::Mat mask = test::lambert_ball_mask();
        write_png(folder_.path() / "photos/mask.png", cv::Mat1b(mask));
        write_lp(folder_.path() / "lights.lp", named(lights));
        ImportOptions options;
        options.folders = {folder_.path() / "photos"};
        options.lights = folder_.path() / "lights.lp";
        options.out = folder_.path() / "session";
        const Session session = import_photographs(options);
        run_calibrate(session);
        return session;
    }

    static Lights named(Lights lights) {
        for (std::size_t i = 0; i < lights.size(); ++i) lights[i].file = "frame" + std::to_string(i + 1) + ".png";
        return lights;
    }

    test::TemporaryFolder folder_;
};

TEST_F(EvaluateSession, ABallAgainstTheSphereInItsMask) {
    const Session session = calibrated();
    EvaluateOptions options;
    options.truth = NormalTruth::ideal_sphere;
    options.compare = {Solver::lsq, Solver::lsq};
    options.reference_lights = folder_.path() / "lights.lp";
    const Evaluation evaluation = evaluate_session(session, options);
    ASSERT_TRUE(evaluation.normals && evaluation.ideal_sphere && evaluation.comparison && evaluation.lights);
    EXPECT_NEAR(evaluation.ideal_sphere->radius, 30, 0.2);
    EXPECT_LT(evaluation.normals->median_deg, 1.0);
    EXPECT_DOUBLE_EQ(evaluation.comparison->difference.mean_difference, 0);
    EXPECT_FALSE(evaluation.comparison->second_is_better());
    EXPECT_LT(evaluation.lights->all.max_deg, 1e-3);
    EXPECT_EQ(evaluation.held_out.size(), 7u);
    EXPECT_EQ(evaluation.predictors, (std::vector<std::string>{"darkbox_thesis", "darkbox_detail", "lambert", "ptm"}));
    EXPECT_FALSE(std::filesystem::exists(session.folder() / "results"));
}

TEST_F(EvaluateSession, DroppedFramesAreLeftOut) {
    const Session session = calibrated();
    EvaluateOptions options;
    options.drop = {"frame3.png"};
    const Evaluation evaluation = evaluate_session(session, options);
    ASSERT_EQ(evaluation.held_out.size(), 6u);
    EXPECT_EQ(evaluation.held_out[2].file, "frame4.png");
    options.drop = {"frame9.png"};
    EXPECT_THAT(test::input_error_of([&] { evaluate_session(session, options); }), HasSubstr("frame9.png"));
}

TEST_F(EvaluateSession, TooFewLightsToLeaveOneOutIsAWarning) {
    const Session session = calibrated();
    EvaluateOptions options;
    options.drop = {"frame1.png", "frame2.png", "frame3.png", "frame4.png"};
    const Evaluation evaluation = evaluate_session(session, options);
    EXPECT_TRUE(evaluation.held_out.empty());
    EXPECT_THAT(evaluation.warnings, testing::ElementsAre(HasSubstr("too few to leave one out")));
}

TEST_F(EvaluateSession, ComparingNeedsATruth) {
    const Session session = calibrated();
    EvaluateOptions options;
    options.compare = {Solver::lsq, Solver::lsq};
    EXPECT_THAT(test::input_error_of([&] { evaluate_session(session, options); }), HasSubstr("no true normals"));
}

TEST(RealCaptures, TheGrayBallAgainstAnIdealSphere) {
    DARKBOX_NEED_DATA(psm, "psm");
    test::TemporaryFolder folder;
    ImportOptions import;
    import.folders = {psm / "gray"};
    import.lights = psm / "lights_reference.txt";
    import.transfer = ImportTransfer::linear;
    import.out = folder.path() / "gray";
    const Session session = import_photographs(import);
    run_calibrate(session);
    EvaluateOptions options;
    options.truth = NormalTruth::ideal_sphere;
    options.held_out = false;
    // The known figures; half a pixel of the sphere's centre, which they do not state, is worth 0.3 degrees.
    EXPECT_NEAR(evaluate_session(session, options).normals->mean_deg, 6.4, 0.3);
    options.drop = {"gray.02.png"};
    EXPECT_NEAR(evaluate_session(session, options).normals->mean_deg, 5.8, 0.3);
}

}  // namespace
}  // namespace darkbox
