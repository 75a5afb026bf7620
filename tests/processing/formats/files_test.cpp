#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "processing/formats/atomic_file.h"
#include "processing/formats/calibration_file.h"
#include "processing/formats/environment_file.h"
#include "processing/formats/exr.h"
#include "processing/formats/png.h"
#include "processing/formats/report/html.h"
#include "processing/formats/report/report.h"
#include "tests/support/test_data.h"
#include "tests/support/throws.h"

namespace darkbox {
namespace {

using test::input_error_of;
using testing::HasSubstr;
namespace fs = std::filesystem;

class Files : public testing::Test {
protected:
    fs::path at(const std::string& name) const { return folder_.path() / name; }
    test::TemporaryFolder folder_;
};

TEST_F(Files, WriteReplacesWholeAndLeavesNothingBehind) {
    write_file(at("deep/er/a.txt"), "one");
    write_file(at("deep/er/a.txt"), "two");
    EXPECT_EQ(read_text(at("deep/er/a.txt")), "two");
    EXPECT_EQ(std::distance(fs::directory_iterator(at("deep/er")), {}), 1);
}

TEST_F(Files, AFailedWriteNamesThePathAndKeepsTheOldFile) {
    write_file(at("a.txt"), "old");
    EXPECT_THAT(input_error_of([&] { write_file(at("a.txt") / "b.txt", "new"); }), HasSubstr("a.txt"));
    EXPECT_EQ(read_text(at("a.txt")), "old");
    EXPECT_THAT(input_error_of([&] { write_file("/dev/full/x", "new"); }), HasSubstr("/dev/full"));
}

TEST_F(Files, CalibrationComesBack) {
    Calibration calibration;
    calibration.lights.resize(2);
    calibration.lights[0] = {"a.png", Eigen::Vector3d(0.1, 0.2, 0.97).normalized(), {1, 2, 3}};
    calibration.lights[0].covariance << 4, 1, 0, 1, 3, 2, 0, 2, 5;
    calibration.lights[0].near = LampPosition{{1, 2, 3}, {4, 5, 6}};
    calibration.view = ViewGeometry{0.25, {160, 120}};
    calibration.lights[1] = {"b.png", {0, 0, 1}, {1, 1, 1}, false};
    calibration.highlights = {Highlight{10.5, 20.25, 0.1, true}, std::nullopt};
    calibration.balls = {{100.5, 90.25, 40.125, 0.9}};
    calibration.condition_number = std::numeric_limits<double>::infinity();
    calibration.method = "refined";
    calibration.intensity_origin = IntensityOrigin::grey_card;
    calibration.warnings = {"b.png has no highlight"};
    write_calibration(at("lights.json"), calibration, {"dome", {"lamp-1", "lamp-2"}});
    const StoredCalibration stored = read_calibration(at("lights.json"));
    const Calibration& read = stored.calibration;
    ASSERT_EQ(read.lights.size(), 2u);
    EXPECT_EQ(read.lights[0].direction, calibration.lights[0].direction);
    EXPECT_EQ(read.lights[0].intensity, calibration.lights[0].intensity);
    EXPECT_EQ(read.lights[0].covariance, calibration.lights[0].covariance);
    EXPECT_EQ(read.lights[0].near.value().object_mm, Eigen::Vector3d(4, 5, 6));
    EXPECT_FALSE(read.lights[1].near);
    EXPECT_EQ(read.view.value().principal.y, 120);
    EXPECT_FALSE(read.view->perspective());
    EXPECT_FALSE(read.lights[1].used);
    EXPECT_EQ(read.highlights[0]->v, 20.25);
    EXPECT_FALSE(read.highlights[1]);
    EXPECT_EQ(read.balls[0].radius, 40.125);
    EXPECT_TRUE(std::isinf(read.condition_number));
    EXPECT_EQ(read.warnings, calibration.warnings);
    EXPECT_EQ(read.intensity_origin, IntensityOrigin::grey_card);
    EXPECT_EQ(stored.rig.name, "dome");
    EXPECT_EQ(stored.rig.lamps[1], "lamp-2");
}

TEST_F(Files, AFileThatIsNoCalibrationIsNamed) {
    write_file(at("lights.json"), "{\"lights\": 3}");
    EXPECT_THAT(input_error_of([&] { read_calibration(at("lights.json")); }),
                HasSubstr("lights.json is not a calibration"));
    write_file(at("lights.json"), "{");
    EXPECT_THAT(input_error_of([&] { read_calibration(at("lights.json")); }), HasSubstr("lights.json is not JSON"));
}

TEST_F(Files, PngKeepsEverySampleOfEveryType) {
    for (const int type : {CV_8UC1, CV_8UC3, CV_16UC1, CV_16UC3}) {
        cv::Mat image(37, 53, type);
        cv::randu(image, cv::Scalar::all(0), cv::Scalar::all(65536));
        write_png(at("a.png"), image);
        const cv::Mat read = read_png(at("a.png"));
        ASSERT_EQ(read.type(), type);
        EXPECT_EQ(cv::norm(read, image, cv::NORM_INF), 0);
        EXPECT_EQ(read_file(at("a.png")), encode_png(image));
    }
    EXPECT_THAT(input_error_of([&] { write_png(at("none.png"), cv::Mat(2, 2, CV_32F)); }),
                HasSubstr("cannot encode a picture of 2x2 pixels"));
    EXPECT_FALSE(fs::exists(at("none.png")));
}

TEST_F(Files, ExrKeepsEveryBitOfEveryChannel) {
    cv::Mat1f noise(37, 53), same(37, 53, 0.1F);
    cv::randu(noise, -3, 1e9);
    write_exr(at("a.exr"), {{"z", noise}, {"a", same}});
    EXPECT_EQ(cv::norm(read_exr_channel(at("a.exr"), "z"), noise, cv::NORM_INF), 0);
    EXPECT_EQ(cv::norm(read_exr_channel(at("a.exr"), "a"), same, cv::NORM_INF), 0);
    EXPECT_THAT(input_error_of([&] { write_exr(at("none.exr"), cv::Mat3f()); }), HasSubstr("no pixels"));
    EXPECT_FALSE(fs::exists(at("none.exr")));
}

TEST_F(Files, EnvironmentsAreCheckedForShapeAndNumbers) {
    cv::Mat3f probe(8, 16, cv::Vec3f(1, 2, 3));
    write_exr(at("e.exr"), probe);
    EXPECT_EQ(read_environment(at("e.exr")).radiance(3, 3), cv::Vec3f(1, 2, 3));
    probe(1, 1)[0] = -1;
    write_exr(at("e.exr"), probe);
    EXPECT_THAT(input_error_of([&] { read_environment(at("e.exr")); }), HasSubstr("negative"));
    write_exr(at("e.exr"), cv::Mat3f(8, 8, cv::Vec3f(1, 1, 1)));
    EXPECT_THAT(input_error_of([&] { read_environment(at("e.exr")); }), HasSubstr("twice as wide"));
    write_file(at("e.hdr"), "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 8 +X 16\nshort");
    EXPECT_THAT(input_error_of([&] { read_environment(at("e.hdr")); }), HasSubstr("e.hdr is cut short"));
    write_file(at("e.hdr"), "P6 1 1\n255");
    EXPECT_THAT(input_error_of([&] { read_environment(at("e.hdr")); }), HasSubstr("not a Radiance"));
}

TEST(RealProbes, AreReadAsOpenCvReadsThem) {
    DARKBOX_NEED_DATA(data, "hdr_probes");
    for (const auto& entry : fs::directory_iterator(data)) {
        if (entry.path().extension() != ".hdr") continue;
        const Environment probe = read_environment(entry.path());
        EXPECT_EQ(probe.radiance.size(), cv::Size(256, 128));
        EXPECT_GT(cv::mean(probe.radiance)[0], 0.01) << entry.path();
        cv::Mat3f known = cv::imread(entry.path().string(), cv::IMREAD_ANYDEPTH | cv::IMREAD_COLOR);
        cv::cvtColor(known, known, cv::COLOR_BGR2RGB);
        EXPECT_EQ(cv::norm(probe.radiance, known, cv::NORM_INF), 0) << entry.path();
        const auto bytes = read_file(entry.path());
        test::TemporaryFolder folder;
        write_file(folder.path() / "cut.hdr", std::span(bytes).first(bytes.size() / 2));
        EXPECT_THROW(read_environment(folder.path() / "cut.hdr"), InputError);
    }
}

TEST(Base64, PadsAsTheStandardSays) {  // RFC 4648, section 10
    const auto of = [](std::string_view text) { return base64(std::as_bytes(std::span(text))); };
    EXPECT_EQ(of(""), "");
    EXPECT_EQ(of("f"), "Zg==");
    EXPECT_EQ(of("fo"), "Zm8=");
    EXPECT_EQ(of("foobar"), "Zm9vYmFy");
}

TEST(Report, IsOnePageWithEveryNameEscaped) {
    const std::string evil = "<script>\"x\"&'";
    ReportContent content;
    content.title = evil;
    content.warnings = {evil};
    content.facts = {{evil, evil}};
    content.pictures = {{cv::Mat3b(4, 4, cv::Vec3b(1, 2, 3)), evil, evil}};
    content.lights.resize(2);
    content.lights[0].file = content.lights[1].file = evil;
    content.lights[1].used = false;
    content.ball = ReportBall{cv::Mat3b(9, 9, cv::Vec3b(0, 0, 0)), {{4, 4, 3, 1}}, {{evil, Highlight{4, 4}}}};
    content.exposure_histogram = {0.5, 0.25, 0.25};
    content.timings = {{evil, 1.5}};
    const std::string page = report_html(content);
    EXPECT_EQ(page.find("<script"), std::string::npos);
    EXPECT_THAT(page, HasSubstr("&lt;script&gt;&quot;x&quot;&amp;&#39;"));
    EXPECT_THAT(page, HasSubstr("data:image/png;base64,iVBOR"));
    EXPECT_EQ(page.find("http"), std::string::npos) << "nothing may be loaded from elsewhere";
}

}  // namespace
}  // namespace darkbox
