#include "processing/pipeline/frame_tally.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/textured_sphere.h"

namespace darkbox {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

/// What it says when the photographs come in bands of so many rows.
std::vector<std::string> told(const test::TexturedSphere& scene, int band_rows) {
    FrameTally tally;
    for (int row = 0; row < scene.stack.mask.rows; row += band_rows) {
        const cv::Range rows(row, std::min(row + band_rows, scene.stack.mask.rows));
        PhotoStack band{{}, {}, scene.stack.files, scene.stack.mask.rowRange(rows)};
        for (const cv::Mat3f& image : scene.stack.images) band.images.push_back(image.rowRange(rows));
        for (const cv::Mat1b& clipped : scene.stack.clipped) band.clipped.push_back(clipped.rowRange(rows));
        tally.add(band);
    }
    return tally.warnings(scene.lights);
}

TEST(FrameTally, GoodPhotographsNeedNoWords) { EXPECT_THAT(told(test::textured_sphere(48), 48), IsEmpty()); }

TEST(FrameTally, BlackAndClippedPhotographsAreNamed) {
    for (const int band_rows : {7, 48}) {
        test::TexturedSphere scene = test::textured_sphere(48, 4);
        scene.stack.images[1] = cv::Vec3f(0, 0, 0);
        scene.stack.clipped[2] = uchar{255};
        EXPECT_THAT(told(scene, band_rows),
                    ElementsAre(HasSubstr("ring-1.png is black"), HasSubstr("ring-2.png is clipped on 100 %")));
        scene.lights[1].used = scene.lights[2].used = false;
        EXPECT_THAT(told(scene, band_rows), IsEmpty());
    }
}

}  // namespace
}  // namespace darkbox
