#include "processing/pipeline/import.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "processing/calibration/intensity.h"
#include "processing/formats/atomic_file.h"
#include "processing/formats/exr.h"
#include "processing/formats/light_files.h"
#include "processing/formats/map_files.h"
#include "processing/formats/picture.h"
#include "processing/formats/png.h"
#include "processing/pipeline/export.h"
#include "processing/pipeline/session_ball.h"
#include "processing/pipeline/stages.h"
#include "tests/processing/pipeline/synthetic_photographs.h"
#include "tests/support/test_data.h"
#include "tests/support/throws.h"

namespace darkbox {
namespace {

using test::input_error_of;
using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;
namespace fs = std::filesystem;

class Import : public testing::Test {
protected:
    fs::path at(const std::string& name) const { return folder_.path() / name; }
    ImportOptions plain() const {
        ImportOptions options;
        options.folders = {at("photos")};
        options.out = at("session");
        return options;
    }
    void write_eight_bit(const fs::path& path, cv::Size size = {6, 4}) {
        write_png(path, cv::Mat(size, CV_8UC3, cv::Scalar::all(200)));
    }
    void write_lights(const fs::path& path) {
        Lights lights = test::lamp_ring();
        for (std::size_t i = 0; i < lights.size(); ++i) lights[i].file = "frame" + std::to_string(i + 1) + ".png";
        write_lp(path, lights);
    }
    std::string error(const ImportOptions& options) {
        const std::string said = input_error_of([&] { import_photographs(options); });
        EXPECT_FALSE(fs::exists(options.out)) << "a failed import must leave nothing";
        return said;
    }
    test::TemporaryFolder folder_;
};

TEST_F(Import, FramesAreInNaturalOrderMasksAreNotFramesAndBytesAreKept) {
    for (const char* name : {"a10.png", "a2.png", "a1.png", "a.Mask.png"}) write_eight_bit(at("photos") / name);
    write_file(at("photos/readme.txt"), "no picture");
    const Session session = import_photographs(plain());
    ASSERT_EQ(session.frames().size(), 3u);
    EXPECT_EQ(session.frames()[0].file, "frames/a1.png");
    EXPECT_EQ(session.frames()[1].file, "frames/a2.png");
    EXPECT_EQ(session.frames()[2].file, "frames/a10.png");
    EXPECT_EQ(read_file(session.path_of(session.frames()[1])), read_file(at("photos/a2.png")));
    EXPECT_THAT(session.extras(), Contains("masks/mask.png"));
    session.verify();
}

TEST_F(Import, TransferCurveFollowsTheBitDepthAndIsNoted) {
    write_eight_bit(at("photos/1.png"));
    const Session eight = import_photographs(plain());
    EXPECT_EQ(eight.frames()[0].transfer, TransferCurve::srgb);
    EXPECT_THAT(eight.info().notes, Contains(HasSubstr("sRGB, chosen by the bit depth")));
    EXPECT_THAT(eight.info().notes, Contains(HasSubstr("only 1 photographs")));
    ImportOptions options = plain();
    options.out = at("linear");
    options.transfer = ImportTransfer::linear;
    EXPECT_EQ(import_photographs(options).frames()[0].transfer, TransferCurve::linear);
    write_png(at("photos/1.png"), cv::Mat(4, 6, CV_16UC3, cv::Scalar::all(100)));
    options.out = at("sixteen");
    options.transfer = ImportTransfer::automatic;
    EXPECT_EQ(import_photographs(options).frames()[0].transfer, TransferCurve::linear);
}

TEST_F(Import, TwoSizesNameBothFiles) {
    write_eight_bit(at("photos/1.png"));
    write_eight_bit(at("photos/2.png"), {6, 5});
    EXPECT_THAT(error(plain()), AllOf(HasSubstr("1.png is 6x4"), HasSubstr("2.png is 6x5")));
}

TEST_F(Import, BadPhotographsAreNamed) {
    write_eight_bit(at("photos/1.png"));
    const auto whole = read_file(at("photos/1.png"));
    write_file(at("photos/2.png"), std::span(whole).first(whole.size() - 9));
    EXPECT_THAT(error(plain()), HasSubstr("2.png is cut short"));
    write_file(at("photos/2.png"), "");
    EXPECT_THAT(error(plain()), HasSubstr("2.png is empty"));
    write_file(at("photos/2.png"), "not a picture");
    EXPECT_THAT(error(plain()), HasSubstr("2.png is not a picture"));
}

TEST_F(Import, AFlatFieldTellsTheLampsIntensities) {
    Lights lights = test::lamp_ring();
    for (std::size_t i = 0; i < lights.size(); ++i) {
        lights[i].file = "frame" + std::to_string(i + 1) + ".png";
        lights[i].intensity = {1.0 + 0.1 * static_cast<double>(i), 1.0, 1.3 - 0.1 * static_cast<double>(i)};
        const Eigen::Vector3d plane = 30'000.0 * lights[i].direction.z() * lights[i].intensity;
        write_png(at("plane") / lights[i].file, cv::Mat(80, 96, CV_16UC3, cv::Scalar(plane.x(), plane.y(), plane.z())));
    }
    test::write_photographs(at("photos"), lights);
    write_lights(at("given.lp"));
    ImportOptions options = plain();
    options.lights = at("given.lp");
    options.flat_images = at("plane");
    const Session session = import_photographs(options);
    EXPECT_EQ(session.frames().size(), 2 * lights.size());
    const Calibration found = run_calibrate(session, {}).calibration;
    EXPECT_EQ(found.intensity_origin, IntensityOrigin::flat);
    const Lights expected = with_mean_intensity_one(lights);
    for (std::size_t i = 0; i < lights.size(); ++i)
        EXPECT_LE((found.lights[i].intensity - expected[i].intensity).norm(), 1e-3) << lights[i].file;
}

TEST_F(Import, AFlatFieldNeedsAPhotographForEachLampOfTheSameSize) {
    write_eight_bit(at("photos/1.png"));
    write_eight_bit(at("photos/2.png"));
    write_eight_bit(at("plane/1.png"));
    ImportOptions options = plain();
    options.flat_images = at("plane");
    EXPECT_THAT(error(options), HasSubstr("1 photographs of the flat field"));
    write_eight_bit(at("plane/1.png"), {6, 5});
    write_eight_bit(at("plane/2.png"), {6, 5});
    EXPECT_THAT(error(options), AllOf(HasSubstr("plane/1.png is 6x5"), HasSubstr("photos/1.png is 6x4")));
}

TEST_F(Import, FoldersWithoutPhotographs) {
    EXPECT_THAT(error(plain()), HasSubstr("photos is not a folder"));
    write_eight_bit(at("photos/mask.png"));
    EXPECT_THAT(error(plain()), HasSubstr("holds no photographs"));
    ImportOptions none = plain();
    none.folders.clear();
    EXPECT_THAT(error(none), HasSubstr("folders is empty"));
}

TEST_F(Import, MasksMustFit) {
    write_eight_bit(at("photos/1.png"));
    ImportOptions options = plain();
    options.mask = at("m.png");
    write_png(at("m.png"), cv::Mat(9, 9, CV_8U, cv::Scalar(255)));
    EXPECT_THAT(error(options), AllOf(HasSubstr("m.png is 9x9"), HasSubstr("1.png is 6x4")));
    write_png(at("m.png"), cv::Mat(4, 6, CV_8U, cv::Scalar(0)));
    EXPECT_THAT(error(options), HasSubstr("black everywhere"));
    write_eight_bit(at("photos/mask_a.png"));
    write_eight_bit(at("photos/mask_b.png"));
    EXPECT_THAT(error(plain()), AllOf(HasSubstr("mask_a.png"), HasSubstr("mask_b.png")));
}

TEST_F(Import, BallCaptureMustMatchFrameByFrame) {
    write_eight_bit(at("photos/1.png"));
    write_eight_bit(at("photos/2.png"));
    write_eight_bit(at("ball/b1.png"));
    ImportOptions options = plain();
    options.ball_images = at("ball");
    EXPECT_THAT(error(options), AllOf(HasSubstr("1 photographs of the ball"), HasSubstr("2 of the object")));
    write_eight_bit(at("ball/b2.png"));
    write_png(at("ball/mask.png"), cv::Mat(4, 6, CV_8U, cv::Scalar(255)));
    const Session session = import_photographs(options);
    EXPECT_EQ(session.frames()[3].file, "frames/ball/b2.png");
    EXPECT_EQ(session.frames()[3].kind, FrameKind::ball);
    EXPECT_THAT(session.extras(), Contains("masks/ball_mask.png"));
    EXPECT_EQ(SessionBall(session, {}).files(), (std::vector<std::string>{"1.png", "2.png"}));
}

TEST_F(Import, LightsOfAnotherCountAreRefused) {
    write_eight_bit(at("photos/1.png"));
    ImportOptions options = plain();
    options.lights = at("lights.txt");
    write_file(at("lights.txt"), "0 0 1\n0 0.6 0.8\n");
    EXPECT_THAT(error(options), HasSubstr("2 lights for 1 photographs"));
    write_file(at("lights.txt"), "1\nother.png 0 0 1\n");
    EXPECT_THAT(error(options), HasSubstr("no light for the photograph 1.png"));
}

TEST_F(Import, ASecondImportDoesNotTouchTheFirst) {
    write_eight_bit(at("photos/1.png"));
    import_photographs(plain());
    EXPECT_THROW(import_photographs(plain()), InputError);
    EXPECT_EQ(Session::open(at("session")).frames().size(), 1u);
}

TEST_F(Import, RtiFolderWithLpRunsFromEndToEnd) {
    test::write_photographs(at("photos"), test::lamp_ring());
    write_png(at("photos/mask.png"), test::lambert_ball_mask());
    write_lights(at("photos/ring.lp"));
    const Session session = import_photographs(plain());
    const ProcessSummary done = run_process(session);
    EXPECT_EQ(done.calibrate.calibration.method, "given");
    EXPECT_LT(done.normals.residual_rms, 0.02);  // attached shadows at the rim
    EXPECT_GT(done.texels.texels, 1);
    for (const char* made :
         {"calibration/lights.json", "calibration/lights.lp", "results/normals.exr", "results/normals.png",
          "results/albedo.exr", "results/albedo.png", "results/confidence.exr", "results/height.exr",
          "results/surface.ply", "texels/index.png", "texels/texels.json", "shading/shading_maps.exr",
          "shading/shading.json", "shading/albedo.exr", "report.html", "results/relit-left.png"})
        EXPECT_TRUE(fs::exists(session.folder() / made)) << made;
    session.verify();
    const RelightScene shaded = load_shaded_scene(session), unshaded = load_scene(session);
    EXPECT_EQ(cv::norm(shaded.albedo.valid, unshaded.albedo.valid, cv::NORM_INF), 0);
    EXPECT_LT(cv::norm(shaded.albedo.albedo, unshaded.albedo.albedo, cv::NORM_RELATIVE | cv::NORM_L2), 0.05);
    EXPECT_GT(cv::norm(shaded.albedo.albedo, unshaded.albedo.albedo, cv::NORM_INF), 0);
    fs::remove(session.folder() / "shading/albedo.exr");
    EXPECT_THAT(input_error_of([&] { load_shaded_scene(session); }), HasSubstr("albedo.exr"));

    export_session(session, ExportFormat::diligent, at("diligent"));
    ImportOptions again;
    again.folders = {at("diligent")};
    again.out = at("again");
    const Session round = import_photographs(again);
    EXPECT_EQ(run_calibrate(round).calibration.lights.size(), 7u);
    run_normals(round);
    const NormalMap before = read_normal_map(session.folder() / "results/normals.exr");
    const NormalMap after = read_normal_map(round.folder() / "results/normals.exr");
    EXPECT_EQ(cv::norm(before.valid, after.valid, cv::NORM_INF), 0);
    EXPECT_LT(cv::norm(before.normal, after.normal, cv::NORM_INF), 1e-4);
    EXPECT_THAT(input_error_of([] { export_format("gif"); }), HasSubstr("'gif'"));
}

TEST_F(Import, RadianceAboveOneKeepsItsAlbedoThroughDiligent) {
    test::write_photographs(at("photos"), test::lamp_ring());
    Lights lights = test::lamp_ring();
    for (std::size_t i = 0; i < lights.size(); ++i) {
        const std::string frame = "frame" + std::to_string(i + 1);
        write_exr(at("bright/" + frame + ".exr"), cv::Mat3f(3 * read_picture(at("photos/" + frame + ".png")).samples));
        lights[i].file = frame + ".exr";
    }
    write_lp(at("bright/ring.lp"), lights);
    ImportOptions options = plain();
    options.folders = {at("bright")};
    const Session session = import_photographs(options);
    run_calibrate(session);
    run_normals(session);
    export_session(session, ExportFormat::diligent, at("diligent"));
    ImportOptions again;
    again.folders = {at("diligent")};
    again.out = at("again");
    const Session round = import_photographs(again);
    run_calibrate(round);
    run_normals(round);
    const AlbedoMap before = read_albedo_map(session.folder() / "results/albedo.exr");
    const AlbedoMap after = read_albedo_map(round.folder() / "results/albedo.exr");
    double most = 0;
    cv::minMaxLoc(before.albedo.reshape(1), nullptr, &most);
    EXPECT_GT(most, 1.2);
    EXPECT_LT(cv::norm(before.albedo, after.albedo, cv::NORM_RELATIVE | cv::NORM_L2), 1e-3);
}

TEST_F(Import, TextureMapsAreExportedAndTheirErrorsAreClear) {
    test::write_photographs(at("photos"), test::lamp_ring());
    write_lights(at("photos/ring.lp"));
    const Session session = import_photographs(plain());
    EXPECT_THAT(input_error_of([&] { export_session(session, ExportFormat::ply, at("s.ply")); }), HasSubstr("surface"));
    run_calibrate(session);
    export_session(session, export_format("ptm"), at("s.ptm"));
    export_session(session, export_format("ptm-rgb"), at("rgb.ptm"));
    export_session(session, export_format("relight"), at("web"));
    EXPECT_GT(fs::file_size(at("rgb.ptm")), 96u * 80u * 18u);
    export_session(session, export_format("relight-rgb"), at("web-rgb"));
    EXPECT_TRUE(fs::exists(at("web/info.json")) && fs::exists(at("web/plane_2.jpg")));
    EXPECT_TRUE(fs::exists(at("web-rgb/plane_5.jpg")));
    EXPECT_THAT(input_error_of([&] { export_session(session, ExportFormat::ptm, "/proc/none/s.ptm"); }),
                HasSubstr("/proc/none"));
}

TEST_F(Import, TwoLightsAndCoplanarLightsAreToldByNormals) {
    Lights lights = test::lamp_ring();
    lights.resize(2);
    test::write_photographs(at("photos"), lights);
    ImportOptions options = plain();
    options.lights = at("lights.txt");
    write_light_directions(at("lights.txt"), lights);
    const Session two = import_photographs(options);
    EXPECT_THAT(run_calibrate(two).calibration.warnings, Contains(HasSubstr("only 2 lights")));
    EXPECT_THAT(input_error_of([&] { run_normals(two); }), HasSubstr("at least three lights"));

    for (const double x : {-0.5, 0.5}) {
        Light light;
        light.direction = Eigen::Vector3d(x, 0, 1).normalized();
        lights.push_back(light);
    }
    lights.erase(lights.begin() + 1);
    write_light_directions(at("lights.txt"), lights);
    test::write_photographs(at("photos"), lights);
    options.out = at("plane");
    const Session plane = import_photographs(options);
    run_calibrate(plane);
    EXPECT_THAT(input_error_of([&] { run_normals(plane); }), HasSubstr("in one plane"));
}

TEST_F(Import, AMissingArtefactNamesTheCommandToRun) {
    test::write_photographs(at("photos"), test::lamp_ring());
    const Session session = import_photographs(plain());
    try {
        run_normals(session);
        FAIL();
    } catch (const InputError& e) {
        EXPECT_THAT(e.what(), HasSubstr("lights.json"));
        EXPECT_THAT(e.hint(), HasSubstr("darkbox calibrate"));
    }
    try {
        run_texels(session);
        FAIL();
    } catch (const InputError& e) {
        EXPECT_THAT(e.hint(), HasSubstr("darkbox normals"));
    }
}

}  // namespace
}  // namespace darkbox
