#include "processing/formats/light_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "processing/formats/atomic_file.h"
#include "tests/support/test_data.h"
#include "tests/support/throws.h"

namespace darkbox {
namespace {

using test::input_error_of;
using testing::HasSubstr;

class LightFiles : public testing::Test {
protected:
    std::filesystem::path file(const std::string& text) {
        write_file(folder_.path() / "lights.txt", text);
        return folder_.path() / "lights.txt";
    }
    LightFile read(const std::string& text) { return read_lights(file(text)); }
    std::string error(const std::string& text) {
        const auto path = file(text);
        return input_error_of([&] { read_lights(path); });
    }
    test::TemporaryFolder folder_;
};

TEST_F(LightFiles, LpWithPathsSpacesTabsAndCrlf) {
    const LightFile lights = read("2\r\nC:\\scan 1\\a 1.jpg\t0.6 0 0.8\r\nsub/b.jpg 0\t-0.6\t0.8\r\n");
    EXPECT_EQ(lights.form, LightFileForm::lp);
    ASSERT_EQ(lights.lights.size(), 2u);
    EXPECT_EQ(lights.lights[0].file, "a 1.jpg");
    EXPECT_EQ(lights.lights[1].file, "b.jpg");
    EXPECT_NEAR(lights.lights[1].direction.y(), -0.6, 1e-12);
    EXPECT_TRUE(lights.warnings.empty());
}

TEST_F(LightFiles, CountedAndBareLines) {
    EXPECT_EQ(read("1\n0 0 1\n").form, LightFileForm::counted);
    const LightFile bare = read("0.6 0 0.8\n0,0,1\n");
    EXPECT_EQ(bare.form, LightFileForm::bare);
    ASSERT_EQ(bare.lights.size(), 2u);
    EXPECT_EQ(bare.lights[1].direction, Eigen::Vector3d(0, 0, 1));
}

TEST_F(LightFiles, DecimalCommasAreReadWithAWarning) {
    const LightFile lights = read("0,6 0 0,8\n");
    EXPECT_NEAR(lights.lights[0].direction.x(), 0.6, 1e-12);
    ASSERT_EQ(lights.warnings.size(), 1u);
    EXPECT_THAT(lights.warnings[0], HasSubstr("decimal commas"));
}

TEST_F(LightFiles, VectorsAreMadeUnitLengthWithAWarning) {
    const LightFile lights = read("1\na.png 0 30 40\n");
    EXPECT_NEAR(lights.lights[0].direction.y(), 0.6, 1e-12);
    EXPECT_THAT(lights.warnings.at(0), HasSubstr("unit length"));
}

TEST_F(LightFiles, EveryErrorNamesFileAndLine) {
    EXPECT_THAT(error("0 0 1\n0 0 1e-5\n"), HasSubstr("lights.txt, line 2: the vector's length is 1e-05"));
    EXPECT_THAT(error("0 0 1\n0 nan 1\n"), HasSubstr("line 2: 'nan' is not a finite number"));
    EXPECT_THAT(error("0 0 1\n\n0 up 1\n"), HasSubstr("line 3: 'up' is not a number"));
    EXPECT_THAT(error("3\na.png 0 0 1\nb.png 0 0 1\n"), HasSubstr("line 1: it announces 3 lights, but 2 follow"));
    EXPECT_THAT(error("1\n0 0 1\n0 1 0\n"), HasSubstr("it announces 1 lights, but 2 follow"));
    EXPECT_THAT(error("2\na.png 0 0 1\n0 0 1\n"), HasSubstr("line 3: a name and x y z"));
    EXPECT_THAT(error("0 0 1\n0 1\n"), HasSubstr("line 2: x y z are needed, but 2"));
    EXPECT_THAT(error("\n# nothing\n"), HasSubstr("holds no lights"));
}

TEST_F(LightFiles, LpIsReadBackAsWritten) {
    Lights lights(3);
    lights[0].file = "frames/my cat.png";
    lights[0].direction = Eigen::Vector3d(0.1, -0.2, 0.9).normalized();
    lights[1].file = "gone.png";
    lights[1].used = false;
    lights[2].file = "b.png";
    const auto path = folder_.path() / "out.lp";
    write_lp(path, lights);
    const LightFile read = read_lights(path);
    ASSERT_EQ(read.lights.size(), 2u);
    EXPECT_EQ(read.lights[0].file, "my_cat.png");
    EXPECT_LT(angle_deg(read.lights[0].direction, lights[0].direction), 1e-6);
}

TEST_F(LightFiles, IntensitiesMustBeAboveZero) {
    const auto good = read_light_intensities(file("1.5 2 3\n2\n"));
    EXPECT_EQ(good.at(0), Eigen::Vector3d(1.5, 2, 3));
    EXPECT_EQ(good.at(1), Eigen::Vector3d(2, 2, 2));
    const auto bad = file("1 1 1\n1 0 1\n");
    EXPECT_THAT(input_error_of([&] { read_light_intensities(bad); }),
                HasSubstr("line 2: an intensity must be above 0"));
}

TEST(RealLightFiles, AreRecognised) {
    DARKBOX_NEED_DATA(data, ".");
    EXPECT_EQ(read_lights(data / "psm/lights_reference.txt").lights.size(), 12u);
    EXPECT_EQ(read_lights(data / "sheep_mirrorball/lights.txt").form, LightFileForm::counted);
    const LightFile diligent = read_lights(data / "diligent_ball/light_directions.txt");
    EXPECT_EQ(diligent.form, LightFileForm::bare);
    EXPECT_EQ(diligent.lights.size(), 96u);
    EXPECT_EQ(read_light_intensities(data / "diligent_ball/light_intensities.txt").size(), 96u);
}

}  // namespace
}  // namespace darkbox
