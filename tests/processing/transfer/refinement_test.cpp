#include "processing/transfer/refinement.h"

#include <gtest/gtest.h>

#include "processing/transfer/measures.h"
#include "tests/processing/transfer/exemplars.h"

namespace darkbox {
namespace {

using test::stony_sphere;
using test::transferred_on;
using test::wavy_normals;

TransferOptions with_passes(int passes) {
    TransferOptions options;
    options.method = TransferMethod::analogies;
    options.passes = passes;
    return options;
}

TransferMeasures measured(const TransferSource& source, const NormalMap& target, const TransferOptions& options) {
    return measure_coordinates(appearance_of(source.normals, source.albedo, 1.0F), target,
                               transferred_on(0, source, target, options).coordinates);
}

TEST(Refinement, LowersTheEnergyAndUsesMoreOfTheSource) {
    const TransferSource source = stony_sphere(96);
    const NormalMap target = wavy_normals({64, 64});
    const TransferMeasures plain = measured(source, target, with_passes(0));
    const TransferMeasures refined = measured(source, target, with_passes(4));
    EXPECT_LT(*refined.joint_energy, *plain.joint_energy);
    EXPECT_LT(*refined.seam, *plain.seam);
    EXPECT_GT(*refined.cover, *plain.cover);
    EXPECT_EQ(*refined.background, 0);
}

TEST(Refinement, DoesNotDependOnThreads) {
    const TransferSource source = stony_sphere(64);
    const NormalMap target = wavy_normals({61, 47});
    const TransferResult one = transferred_on(1, source, target, with_passes(2));
    EXPECT_TRUE(test::equal(one.coordinates, transferred_on(2, source, target, with_passes(2)).coordinates));
    EXPECT_TRUE(test::equal(one.coordinates, transferred_on(8, source, target, with_passes(2)).coordinates));
}

TEST(Refinement, TakesOnlyValidPixelsAndLeavesTheOutsideAlone) {
    const TransferSource source = stony_sphere(64);
    NormalMap target = wavy_normals({48, 48});
    target.valid(cv::Rect(10, 12, 9, 14)).setTo(0);
    const cv::Mat2i coordinates = transferred_on(0, source, target, with_passes(2)).coordinates;
    for (int y = 0; y < 48; ++y)
        for (int x = 0; x < 48; ++x) {
            if (target.valid(y, x))
                EXPECT_NE(source.normals.valid(cv::Point(coordinates(y, x))), 0);
            else
                EXPECT_EQ(coordinates(y, x), cv::Vec2i(-1, -1));
        }
}

TEST(Refinement, TakesAnySize) {
    TransferSource one = stony_sphere(32);
    one.normals.valid.setTo(0);
    one.normals.valid(16, 16) = 255;
    const TransferResult everywhere = transferred_on(0, one, wavy_normals({9, 7}), with_passes(2));
    for (const cv::Vec2i& c : everywhere.coordinates) EXPECT_EQ(c, cv::Vec2i(16, 16));
    const TransferSource source = stony_sphere(32);
    for (const cv::Size size : {cv::Size(1, 1), cv::Size(3, 5000), cv::Size(64, 5)})
        EXPECT_EQ(transferred_on(0, source, wavy_normals(size), with_passes(1)).coordinates.size(), size);
}

}  // namespace
}  // namespace darkbox
