#include "processing/pipeline/frame_tally.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/textured_sphere.h"

namespace darkbox {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

/// The tally of photographs that come in bands of so many rows.
FrameTally tally_of(const test::TexturedSphere& scene, int band_rows) {
    FrameTally tally;
    for (int row = 0; row < scene.stack.mask.rows; row += band_rows) {
        const cv::Range rows(row, std::min(row + band_rows, scene.stack.mask.rows));
        PhotoStack band{{}, {}, scene.stack.files, scene.stack.mask.rowRange(rows)};
        for (const cv::Mat3f& image : scene.stack.images) band.images.push_back(image.rowRange(rows));
        for (const cv::Mat1b& clipped : scene.stack.clipped) band.clipped.push_back(clipped.rowRange(rows));
        tally.add(band, scene.lights);
    }
    return tally;
}

TEST(FrameTally, GoodPhotographsNeedNoWords) {
    const test::TexturedSphere scene = test::textured_sphere(48);
    EXPECT_THAT(tally_of(scene, 48).warnings(scene.lights), IsEmpty());
    EXPECT_THAT(tally_of(scene, 48).black(scene.lights), IsEmpty());
}

TEST(FrameTally, BlackAndClippedPhotographsAreNamed) {
    for (const int band_rows : {7, 48}) {
        test::TexturedSphere scene = test::textured_sphere(48, 6);
        scene.stack.images[1] = cv::Vec3f(0, 0, 0);
        scene.stack.clipped[2] = uchar{255};
        const FrameTally tally = tally_of(scene, band_rows);
        EXPECT_THAT(tally.warnings(scene.lights), ElementsAre(HasSubstr("ring-2.png is clipped on 100 %")));
        EXPECT_THAT(tally.black(scene.lights), ElementsAre(1U));
        scene.lights[1].used = scene.lights[2].used = false;
        EXPECT_THAT(tally.warnings(scene.lights), IsEmpty());
        EXPECT_THAT(tally.black(scene.lights), IsEmpty());
    }
}

TEST(FrameTally, APartClippedInTooManyPhotographsIsTold) {
    test::TexturedSphere scene = test::textured_sphere(48, 6);
    for (std::size_t i = 0; i < 4; ++i) scene.stack.clipped[i].rowRange(20, 28).setTo(255);
    EXPECT_THAT(tally_of(scene, 7).warnings(scene.lights), ElementsAre(HasSubstr("so many photographs")));
    scene.stack.clipped[3].setTo(0);
    EXPECT_THAT(tally_of(scene, 7).warnings(scene.lights), IsEmpty());
}

}  // namespace
}  // namespace darkbox
