#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "processing/formats/light_files.h"
#include "processing/pipeline/import.h"
#include "processing/pipeline/stages.h"
#include "tests/support/test_data.h"

namespace darkbox {
namespace {

using testing::Contains;
using testing::HasSubstr;

ImportOptions cat_with_chrome(const std::filesystem::path& psm, const std::filesystem::path& out) {
    ImportOptions options;
    options.folders = {psm / "cat"};
    options.ball_images = psm / "chrome";
    options.mask = psm / "cat/mask.png";
    options.transfer = ImportTransfer::linear;
    options.out = out;
    return options;
}

TEST(RealSessions, CatUnderTheLightsReadOffTheChromeBall) {
    DARKBOX_NEED_DATA(psm, "psm");
    test::TemporaryFolder folder;
    const Session session = import_photographs(cat_with_chrome(psm, folder.path() / "cat"));
    ASSERT_EQ(session.frames().size(), 24u);
    const Lights found = run_calibrate(session).calibration.lights;
    const Lights reference = read_lights(psm / "lights_reference.txt").lights;
    ASSERT_EQ(found.size(), reference.size());
    double sum = 0, worst = 0;
    for (std::size_t i = 0; i < found.size(); ++i) {
        const double angle = angle_deg(found[i].direction, reference[i].direction);
        sum += angle;
        worst = std::max(worst, angle);
    }
    EXPECT_LE(sum / static_cast<double>(found.size()), 0.5);
    EXPECT_LE(worst, 1.0);
    const NormalsSummary normals = run_normals(session);
    EXPECT_TRUE(normals.warnings.empty());
    EXPECT_GT(normals.pixels, 30000u);
}

TEST(RealSessions, TheWrongTransferCurveIsToldByTheResidual) {
    DARKBOX_NEED_DATA(psm, "psm");
    test::TemporaryFolder folder;
    ImportOptions options;
    options.folders = {psm / "gray"};
    options.lights = psm / "lights_reference.txt";
    options.out = folder.path() / "gray";
    const Session session = import_photographs(options);
    EXPECT_THAT(session.info().notes, Contains(HasSubstr("sRGB, chosen by the bit depth")));
    run_calibrate(session);
    EXPECT_THAT(run_normals(session).warnings, Contains(HasSubstr("--transfer linear")));
}

TEST(RealSessions, DiligentBallByItsOwnFiles) {
    DARKBOX_NEED_DATA(diligent, "diligent_ball");
    test::TemporaryFolder folder;
    ImportOptions options;
    options.folders = {diligent};
    options.out = folder.path() / "ball";
    const Session session = import_photographs(options);
    EXPECT_EQ(session.frames().size(), 96u);
    EXPECT_EQ(run_calibrate(session).calibration.method, "given");
    const NormalsSummary normals = run_normals(session);
    ASSERT_TRUE(normals.mean_angular_error_deg);
    EXPECT_LE(*normals.mean_angular_error_deg, 4.2);
}

/// The capture's own intensities, which differ by more than six times, are found again without them.
TEST(RealSessions, DiligentBallsIntensitiesFromItsPhotographs) {
    DARKBOX_NEED_DATA(diligent, "diligent_ball");
    test::TemporaryFolder folder;
    ImportOptions options;
    options.folders = {diligent};
    options.out = folder.path() / "ball";
    const Session session = import_photographs(options);
    const Calibration calibration = run_calibrate(session).calibration;
    ASSERT_EQ(calibration.intensity_origin, IntensityOrigin::given);
    const Lights given = with_mean_intensity_one(calibration.lights);
    NormalsOptions estimate;
    estimate.intensities = IntensityChoice::estimate;
    const NormalsSummary normals = run_normals(session, estimate);
    EXPECT_EQ(normals.intensity_origin, IntensityOrigin::estimated);
    EXPECT_THAT(normals.warnings, Contains(HasSubstr("differ in brightness by")));
    for (int channel = 0; channel < 3; ++channel) {
        double sum = 0, worst = 0;
        for (std::size_t i = 0; i < given.size(); ++i) {
            const double error = std::abs(normals.lights[i].intensity[channel] / given[i].intensity[channel] - 1);
            sum += error;
            worst = std::max(worst, error);
        }
        EXPECT_LE(sum / static_cast<double>(given.size()), 0.015) << channel;
        EXPECT_LE(worst, 0.07) << channel;
    }
    EXPECT_LE(normals.mean_angular_error_deg.value(), 4.2);
    EXPECT_EQ(load_lights(session).front().intensity, normals.lights.front().intensity);
}

TEST(RealSessions, EqualLampsStayAsTheyAre) {
    DARKBOX_NEED_DATA(psm, "psm");
    test::TemporaryFolder folder;
    const Session session = import_photographs(cat_with_chrome(psm, folder.path() / "cat"));
    run_calibrate(session);
    EXPECT_EQ(run_normals(session).intensity_origin, IntensityOrigin::unknown);
}

}  // namespace
}  // namespace darkbox
