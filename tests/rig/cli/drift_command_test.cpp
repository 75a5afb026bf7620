// darkbox drift as it is run: calibrations on disk, sentences and figures out.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "processing/formats/calibration_file.h"
#include "tests/rig/cli/program.h"
#include "tests/support/test_data.h"

namespace darkbox {
namespace {

using nlohmann::json;
using testing::HasSubstr;

constexpr int lamp_count = 9;

/// Nine lamps of one rig 40 degrees off the view axis, known to 0.1 degrees.
Calibration nine_lamps() {
    Calibration calibration;
    constexpr double sigma_rad = 0.1 * M_PI / 180;
    for (int i = 0; i < lamp_count; ++i) {
        const double turn = 2 * M_PI * i / lamp_count, z = std::cos(40 * M_PI / 180), r = std::sqrt(1 - z * z);
        Light light;
        light.file = "frame" + std::to_string(i) + ".png";
        light.direction = {r * std::cos(turn), r * std::sin(turn), z};
        light.covariance =
            sigma_rad * sigma_rad * (Eigen::Matrix3d::Identity() - light.direction * light.direction.transpose());
        calibration.lights.push_back(light);
    }
    return calibration;
}

class DriftCommand : public testing::Test {
protected:
    std::string stored(const std::string& name, const Calibration& calibration) const {
        RigIdentity rig{"dome", {}};
        for (int i = 0; i < lamp_count; ++i) rig.lamps.push_back("lamp-" + std::to_string(i + 1));
        const auto path = folder_.path() / name;
        write_calibration(path, calibration, rig);
        return path.string();
    }
    test::TemporaryFolder folder_;
};

TEST_F(DriftCommand, TwoSwappedLampsAreNamedAndFailUnderStrict) {
    Calibration after = nine_lamps();
    std::swap(after.lights[2].direction, after.lights[6].direction);
    std::swap(after.lights[2].covariance, after.lights[6].covariance);
    const std::string before = stored("march.json", nine_lamps()), later = stored("may.json", after);
    const auto told = test::darkbox_program({"drift", before, later, "--json"});
    ASSERT_EQ(told.status, 0) << told.err;
    EXPECT_THAT(told.err, HasSubstr("lamp-3 and lamp-7 are swapped"));
    const json result = json::parse(told.out);
    EXPECT_FALSE(result.at("steady").get<bool>());
    EXPECT_EQ(result.at("lamps").at(2).at("finding"), "swapped");
    EXPECT_EQ(result.at("lamps").at(2).at("partner"), "lamp-7");
    EXPECT_EQ(result.at("lamps").at(0).at("finding"), "steady");
    EXPECT_EQ(test::darkbox_program({"drift", before, later, "--strict"}).status, 3);
}

TEST_F(DriftCommand, ARigThatStoodStillIsSteady) {
    const std::string before = stored("march.json", nine_lamps());
    const auto told = test::darkbox_program({"drift", before, before, "--strict"});
    EXPECT_EQ(told.status, 0) << told.err;
    EXPECT_THAT(told.out, HasSubstr("nothing moved"));
}

TEST_F(DriftCommand, WhatIsNoCalibrationIsNamed) {
    const std::string before = stored("march.json", nine_lamps());
    const std::string missing = (folder_.path() / "may.json").string();
    const auto told = test::darkbox_program({"drift", before, missing});
    EXPECT_EQ(told.status, 1);
    EXPECT_THAT(told.err, HasSubstr(missing));
}

}  // namespace
}  // namespace darkbox
