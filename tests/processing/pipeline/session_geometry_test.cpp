#include "processing/pipeline/session_geometry.h"

#include <gmock/gmock.h>

#include <vector>

#include "acquisition/session/session_writer.h"
#include "tests/support/test_data.h"

namespace darkbox {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

/// One grey frame for each of these lamps.
Session session_of(const test::TemporaryFolder& folder, const std::optional<CaptureGeometry>& geometry,
                   const std::vector<std::string>& lamps) {
    SessionInfo info;
    info.rig = "dome";
    info.geometry = geometry;
    SessionWriter writer = SessionWriter::create(folder.path() / "s", info);
    Frame frame;
    frame.width = 40;
    frame.height = 30;
    frame.format = PixelFormat::grey16;
    frame.bit_depth = 12;
    frame.pixels.resize(40 * 30 * 2);
    for (std::size_t i = 0; i < lamps.size(); ++i) {
        FrameRecord record;
        record.lamp = LampId{static_cast<std::uint32_t>(i)};
        record.lamp_name = lamps[i];
        writer.add(frame, record);
    }
    return writer.seal();
}

CaptureGeometry two_lamps() {
    CaptureGeometry geometry;
    geometry.mm_per_pixel = 0.5;
    geometry.camera_distance_mm = 800;
    geometry.ball_diameter_mm = 36;
    geometry.lamps = {{"left", {-300, 0, 400}}, {"top", {0, 300, 400}}};
    return geometry;
}

TEST(SessionGeometry, FillsWhatTheOptionsLeaveOpen) {
    const test::TemporaryFolder folder;
    const Session session = session_of(folder, two_lamps(), {"top", "left", "spare"});
    const CalibrationOptions options = with_geometry(session, {}, {40, 30});
    ASSERT_TRUE(options.view && options.nominal);
    EXPECT_EQ(options.view->mm_per_pixel, 0.5);
    EXPECT_EQ(options.view->distance_mm, 800);
    EXPECT_EQ(options.view->principal, cv::Point2d(19.5, 14.5));
    EXPECT_EQ(options.ball_diameter_mm, 36);
    EXPECT_THAT(options.nominal->position_in_rig_mm,
                ElementsAre(Eigen::Vector3d(0, 300, 400), Eigen::Vector3d(-300, 0, 400), std::nullopt));
}

TEST(SessionGeometry, YieldsToTheOptionsAndToParallelLight) {
    const test::TemporaryFolder folder;
    CaptureGeometry geometry = two_lamps();
    geometry.distant_lamps = true;
    const Session session = session_of(folder, geometry, {"left", "top"});
    CalibrationOptions asked;
    asked.ball_diameter_mm = 20;
    const CalibrationOptions options = with_geometry(session, asked, {40, 30});
    EXPECT_EQ(options.ball_diameter_mm, 20);
    EXPECT_EQ(options.lamps, LampModel::distant);
    EXPECT_FALSE(options.nominal);
}

TEST(UnusedGeometry, IsToldWithWhatWouldLetItBeUsed) {
    const test::TemporaryFolder folder;
    CaptureGeometry geometry = two_lamps();
    geometry.mm_per_pixel.reset();
    geometry.ball_diameter_mm.reset();
    const Session session = session_of(folder, geometry, {"left", "top"});
    const CalibrationOptions options = with_geometry(session, {}, {40, 30});
    EXPECT_THAT(unused_geometry(session, options),
                ElementsAre(AllOf(HasSubstr("taken as orthographic"), HasSubstr("mm_per_pixel")),
                            AllOf(HasSubstr("taken as distant"), HasSubstr("--ball-diameter"))));
    CalibrationOptions told = options;
    told.lamps = LampModel::distant;
    EXPECT_THAT(unused_geometry(session, told), ElementsAre(HasSubstr("orthographic")));
}

TEST(UnusedGeometry, IsNoneWhereTheScaleIsKnown) {
    const test::TemporaryFolder folder;
    const Session session = session_of(folder, two_lamps(), {"left", "top"});
    EXPECT_THAT(unused_geometry(session, with_geometry(session, {}, {40, 30})), IsEmpty());
}

TEST(DescribedLights, AreTheDirectionsOfTheDescribedLamps) {
    const test::TemporaryFolder folder;
    const auto described = described_lights(session_of(folder, two_lamps(), {"left", "top"}));
    ASSERT_TRUE(described);
    EXPECT_EQ(described->rig.name, "dome");
    EXPECT_THAT(described->rig.lamps, ElementsAre("left", "top"));
    EXPECT_TRUE(described->lights[0].direction.isApprox(Eigen::Vector3d(-0.6, 0, 0.8)));
    EXPECT_TRUE(described->lights[1].direction.isApprox(Eigen::Vector3d(0, 0.6, 0.8)));
}

TEST(DescribedLights, AreNoneWhereTheSessionKnowsNone) {
    const test::TemporaryFolder folder;
    EXPECT_FALSE(described_lights(session_of(folder, std::nullopt, {"left"})));
}

}  // namespace
}  // namespace darkbox
