#include "rig/cli/relit_files.h"

#include <gmock/gmock.h>

#include "processing/formats/exr.h"
#include "processing/formats/png.h"
#include "tests/support/test_data.h"
#include "tests/support/throws.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;
using test::input_error_of;
using testing::ElementsAre;
using testing::HasSubstr;

TEST(PictureNames, OnePictureIsItsName) {
    EXPECT_THAT(picture_names("relit.png", 1), ElementsAre("relit.png"));
    EXPECT_THAT(picture_names("relit.EXR.exr", 1), ElementsAre("relit.EXR.exr"));
}

TEST(PictureNames, SeveralAreNumberedFromOne) {
    EXPECT_THAT(picture_names("frames", 3), ElementsAre("frames/0001.png", "frames/0002.png", "frames/0003.png"));
    EXPECT_THAT(picture_names("f/%03d-x.exr", 2), ElementsAre("f/001-x.exr", "f/002-x.exr"));
    EXPECT_EQ(picture_names("%d.jpg", 12).back(), "12.jpg");
    EXPECT_EQ(picture_names("%02d.jpg", 120).back(), "120.jpg");
    EXPECT_THAT(picture_names("frames/%04d.png", 1), ElementsAre("frames/0001.png"));
}

TEST(PictureNames, OneNameForSeveralIsRefused) {
    for (const char* bad : {"x.png", "x%s.png", "x%04.png", "%d-%d.png", "%0d.png", "%99999999999d.png", "x%.png"})
        EXPECT_THAT(input_error_of([&] { picture_names(bad, 2); }), HasSubstr("one picture")) << bad;
}

TEST(PictureNames, OtherEndingsAreRefusedAndVideosExplained) {
    EXPECT_THAT(input_error_of([] { picture_names("x.bmp", 1); }), HasSubstr("not a picture"));
    EXPECT_THAT(input_error_of([] { picture_names("x.mp4", 9); }), HasSubstr("video"));
}

/// One pixel whose radiance at r is r / 2, red; its albedo is its texel's mean.
RelightScene red_pixel() {
    const cv::Size one(1, 1);
    RelightScene scene{{cv::Mat3f(one, cv::Vec3f(0, 0, 1)), cv::Mat1b(one, uchar{255})},
                       {cv::Mat3f(one, cv::Vec3f(0.5F, 0, 0)), cv::Mat1b(one, uchar{255})},
                       {cv::Mat1w(one, std::uint16_t{1}), 1},
                       {1, 2, cv::Mat3f(1, 2), cv::Mat1i(1, 2, 9), cv::Mat3f(1, 1, cv::Vec3f(0.5F, 0, 0))}};
    scene.shading.radiance(0, 0) = {0, 0, 0};
    scene.shading.radiance(0, 1) = {0.5F, 0, 0};
    return scene;
}

TEST(RenderToFile, WritesWhatTheEndingSays) {
    const test::TemporaryFolder folder;
    const Relighter relighter(red_pixel());
    const Lighting half = ConstantCoefficient{0.5};
    const auto written = [&](const char* name, int bits) {
        const fs::path path = folder.path() / name;
        EXPECT_GT(render_to_file(relighter, half, {}, {.gain = 3, .bits = bits}, path, {}), 0);
        return path;
    };
    // 0.25 times three is sRGB 0.880825.
    EXPECT_EQ(read_png(written("8.png", 8)).at<cv::Vec3b>(0, 0), cv::Vec3b(225, 0, 0));
    EXPECT_EQ(read_png(written("16.png", 16)).at<cv::Vec3w>(0, 0), cv::Vec3w(57725, 0, 0));
    EXPECT_EQ(read_exr_colour(written("radiance.exr", 8))(0, 0), cv::Vec3f(0.25F, 0, 0));
    EXPECT_TRUE(fs::exists(written("new/folder/picture.jpg", 8)));
}

TEST(GainUnder, ProbesOfAnyUnitFillTheRange) {
    const RelightScene scene = red_pixel();
    const Relighter relighter(scene);
    for (const float unit : {0.01F, 1.0F, 300.0F}) {
        RelightOptions options;
        const FoldedEnvironment sky = relighter.fold({cv::Mat3f(8, 16, cv::Vec3f(unit, unit, unit))}, options);
        options.exposure = 7;  // counts on top
        options.exposure = gain_under(sky, relighter, options, scene.normals.valid, {});
        cv::Mat3f image(1, 1);
        relighter.render(sky, options, image);
        EXPECT_NEAR(image(0, 0)[0], 1, 1e-4) << unit;
    }
}

}  // namespace
}  // namespace darkbox
