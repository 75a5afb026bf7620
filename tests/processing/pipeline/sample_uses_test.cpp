#include "processing/pipeline/sample_uses.h"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "processing/formats/atomic_file.h"
#include "processing/formats/map_files.h"
#include "processing/formats/png.h"
#include "processing/pipeline/import.h"
#include "processing/pipeline/session_files.h"
#include "processing/pipeline/stages.h"
#include "tests/processing/pipeline/synthetic_photographs.h"
#include "tests/support/test_data.h"
#include "tests/support/throws.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

uchar grey(SampleUse use) { return static_cast<uchar>(use); }

bool same(const cv::Mat1b& a, const cv::Mat1b& b) { return a.size() == b.size() && cv::norm(a, b, cv::NORM_INF) == 0; }

Session session_of_a_ball(const fs::path& folder) {
    const Lights lights = test::lamp_ring();
    fs::create_directories(folder / "photos");
    test::write_photographs(folder / "photos", lights);
    std::string directions;
    for (const Light& light : lights)
        directions += fmt::format("{} {} {}\n", light.direction.x(), light.direction.y(), light.direction.z());
    write_file(folder / "lights.txt", directions);
    ImportOptions import;
    import.folders = {folder / "photos"};
    import.lights = folder / "lights.txt";
    import.transfer = ImportTransfer::linear;
    import.out = folder / "s";
    return import_photographs(import);
}

TEST(SampleUsesOfASession, ShowWhereEachLampCastsItsShadow) {
    const test::TemporaryFolder folder;
    const Session session = session_of_a_ball(folder.path());
    run_calibrate(session);
    NormalsOptions options;
    options.shadows = true;
    options.surface = false;
    EXPECT_THAT(test::input_error_of([&] { run_normals(session, options); }), HasSubstr("least squares"));
    options.stereo.solver = Solver::robust;
    const NormalsSummary summary = run_normals(session, options);

    const ResultFiles files(session.folder());
    const NormalMap normals = read_normal_map(files.normals);
    ASSERT_EQ(summary.shadows.size(), 7U);
    for (std::size_t i = 0; i < summary.shadows.size(); ++i) {
        const SampleShares& shares = summary.shadows[i];
        EXPECT_EQ(shares.file, summary.lights[i].file);
        const cv::Mat1b picture = read_png(files.shadows / fs::path(shares.file).filename());
        ASSERT_EQ(picture.size(), normals.valid.size());
        double kept = 0;
        for (int y = 0; y < picture.rows; ++y)
            for (int x = 0; x < picture.cols; ++x) {
                const bool valid = normals.valid(y, x) != 0;
                ASSERT_EQ(picture(y, x) == grey(SampleUse::no_normal), !valid);
                kept += picture(y, x) == grey(SampleUse::kept) ? 1 : 0;
                const cv::Vec3f& n = normals.normal(y, x);
                const double cosine = summary.lights[i].direction.dot(Eigen::Vector3d(n[0], n[1], n[2]));
                if (valid && cosine < 0) {
                    EXPECT_EQ(picture(y, x), grey(SampleUse::shadow)) << i << ' ' << y << ' ' << x;
                }
                if (valid && cosine > 0.2) {
                    EXPECT_EQ(picture(y, x), grey(SampleUse::kept)) << i << ' ' << y << ' ' << x;
                }
            }
        EXPECT_DOUBLE_EQ(shares.kept, kept / cv::countNonZero(normals.valid));
        EXPECT_NEAR(shares.kept + shares.shadow + shares.highlight + shares.clipped, 1.0, 1e-12);
    }

    options.shadows = false;
    run_normals(session, options);
    EXPECT_FALSE(fs::exists(files.shadows)) << "of normals that are no more";
}

TEST(SampleUsesOnDisk, AreThoseOfTheLastTelling) {
    const test::TemporaryFolder folder;
    SampleUses uses(folder.path() / "shadows", {5, 2}, 3);
    const std::vector<SampleUse> row{SampleUse::kept, SampleUse::shadow, SampleUse::clipped, SampleUse::highlight,
                                     SampleUse::kept};
    uses.take(0, 0, std::vector(5, SampleUse::shadow));
    uses.take(1, 0, row);
    uses.take(0, 0, row);
    uses.take(0, 2, std::vector(5, SampleUse::kept));
    uses.take(1, 2, std::vector(5, SampleUse::highlight));
    Lights lights(3);
    lights[0].file = "a.png";
    lights[1].file = "b.png";
    lights[1].used = false;
    lights[2].file = "a.tif";
    cv::Mat1b valid(2, 5, uchar{255});
    valid(1, 4) = 0;
    const auto shares = uses.write(lights, valid, {});
    EXPECT_TRUE(same(read_png(folder.path() / "shadows/a.png"),
                     (cv::Mat1b(2, 5) << 255, 64, 128, 192, 255, 255, 64, 128, 192, 0)));
    EXPECT_TRUE(same(read_png(folder.path() / "shadows/a.tif.png"),
                     (cv::Mat1b(2, 5) << 255, 255, 255, 255, 255, 192, 192, 192, 192, 0)));
    EXPECT_FALSE(fs::exists(folder.path() / "shadows/b.png"));
    ASSERT_EQ(shares.size(), 2U);
    EXPECT_DOUBLE_EQ(shares[0].kept, 3.0 / 9);
    EXPECT_DOUBLE_EQ(shares[1].highlight, 4.0 / 9);
}

TEST(SampleUsesOnDisk, WantTheirRoomBeforehand) {
    const test::TemporaryFolder folder;
    EXPECT_THAT(test::input_error_of([&] { SampleUses(folder.path() / "shadows", {60000, 60000}, 20000); }),
                HasSubstr("cannot make room for a temporary file"));
}

}  // namespace
}  // namespace darkbox
