#include "processing/formats/picture_metadata.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "processing/formats/atomic_file.h"
#include "processing/formats/jpeg_writer.h"
#include "processing/formats/picture.h"
#include "processing/formats/png.h"
#include "tests/support/child_process.h"
#include "tests/support/test_data.h"
#include "tests/support/throws.h"

namespace darkbox {
namespace {

using namespace test;
using nlohmann::json;
using testing::HasSubstr;

const PictureMetadata vase{
    .object = "vase",
    .inventory = "1907.12 a",
    .dublin_core = {{"title", {"A vase: Ørsted's"}},
                    {"creator", {"Potter, A.", "Ångström"}},
                    {"description", {"Red figures.\nTwo handles"}},
                    {"rights", {"CC BY 4.0"}},
                    {"subject", {"vase", "myth"}},
                    {"date", {"1907"}},
                    {"coverage", {"Athens"}}},
    .software = "darkbox 1.2.3",
    .provenance = {
        {"Solver", "robust"}, {"Session", "vase-1"}, {"Parameters", "normals.solver=robust; a=<b> & \"c\""}}};

/// What ExifTool, which shares no code with what wrote it, reads.
json exiftool(const std::filesystem::path& picture, const std::filesystem::path& log) {
    ChildProcess program({"/usr/bin/exiftool", "-json", "-G1", "-struct", picture.string()}, log);
    EXPECT_EQ(program.wait(), 0) << program.err();
    return json::parse(program.out()).at(0);
}

class PictureMetadataTest : public testing::TestWithParam<const char*> {
protected:
    static void SetUpTestSuite() {
        if (!std::filesystem::exists("/usr/bin/exiftool")) GTEST_SKIP() << "exiftool is not installed";
    }

    std::filesystem::path picture() const { return folder_.path() / (std::string("a") + GetParam()); }
    /// 16 bits where the format has them.
    void write_picture() const {
        cv::Mat3w image(37, 53);
        cv::randu(image, 0, 65535);
        cv::Mat3b bytes;
        image.convertTo(bytes, CV_8U, 1.0 / 257);
        if (picture().extension() == ".png") write_png(picture(), image);
        if (picture().extension() == ".jpg") write_file(picture(), encode_jpeg(bytes, 95));
        if (picture().extension() == ".tif") cv::imwrite(picture().string(), image);
    }
    TemporaryFolder folder_;
};

TEST_P(PictureMetadataTest, IsReadBackByAnotherProgram) {
    write_picture();
    embed_metadata(picture(), vase);
    const json read = exiftool(picture(), folder_.path() / "log");
    EXPECT_EQ(read.at("XMP-dc:Title"), "A vase: Ørsted's");
    EXPECT_EQ(read.at("XMP-dc:Creator"), json({"Potter, A.", "Ångström"}));
    EXPECT_EQ(read.at("XMP-dc:Description"), "Red figures.\nTwo handles");
    EXPECT_EQ(read.at("XMP-dc:Rights"), "CC BY 4.0");
    EXPECT_EQ(read.at("XMP-dc:Subject"), json({"vase", "myth"}));
    EXPECT_EQ(read.at("XMP-dc:Identifier"), "1907.12 a");
    EXPECT_EQ(read.at("XMP-dc:Coverage"), "Athens");
    EXPECT_EQ(read.at("XMP-xmp:CreatorTool"), "darkbox 1.2.3");
    EXPECT_EQ(read.at("XMP-darkbox:Solver"), "robust");
    EXPECT_EQ(read.at("XMP-darkbox:Parameters"), "normals.solver=robust; a=<b> & \"c\"");
    EXPECT_FALSE(read.contains("ExifTool:Warning")) << read.dump(1);
    if (picture().extension() == ".png") return;
    EXPECT_EQ(read.at("IPTC:ObjectName"), "A vase: Ørsted's");
    EXPECT_EQ(read.at("IPTC:By-line"), json({"Potter, A.", "Ångström"}));
    EXPECT_EQ(read.at("IPTC:CopyrightNotice"), "CC BY 4.0");
}

TEST_P(PictureMetadataTest, LeavesSamplesAsTheyAre) {
    write_picture();
    const Picture before = read_picture(picture());
    embed_metadata(picture(), vase);
    const Picture after = read_picture(picture());
    EXPECT_EQ(after.bit_depth, before.bit_depth);
    EXPECT_EQ(cv::norm(after.samples, before.samples, cv::NORM_INF), 0);
}

TEST_P(PictureMetadataTest, IsTheSameEveryTime) {
    write_picture();
    const auto bytes = read_file(picture());
    const auto once = with_metadata(bytes, vase, "a");
    EXPECT_GT(once.size(), bytes.size());
    EXPECT_EQ(with_metadata(bytes, vase, "a"), once);
    EXPECT_EQ(with_metadata(once, vase, "a"), once);  // replaces what was there
}

INSTANTIATE_TEST_SUITE_P(Formats, PictureMetadataTest, testing::Values(".png", ".jpg", ".tif"),
                         [](const auto& tested) { return std::string(tested.param).substr(1); });

TEST(PictureMetadataErrorsTest, NameTheFile) {
    const std::vector<std::byte> nonsense(100, std::byte{7});
    EXPECT_THAT(input_error_of([&] { (void)with_metadata(nonsense, vase, "a.png"); }), HasSubstr("a.png"));
    auto cut = encode_png(cv::Mat1b(50, 50, uchar{9}));
    cut.resize(cut.size() / 2);
    EXPECT_THAT(input_error_of([&] { (void)with_metadata(cut, vase, "b.png"); }), HasSubstr("b.png"));
}

}  // namespace
}  // namespace darkbox
