#include <gmock/gmock.h>

#include "acquisition/frame/error.h"
#include "rig/description/rig_description.h"

namespace darkbox {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

std::string simulated(const std::string& sections, const std::string& lamp_keys = "") {
    return "[rig]\nname = \"r\"\n" + sections +
           "\n[lamps]\ndriver = \"sim\"\n[[lamps.lamp]]\nname = \"a\"\nchannel = 0\nposition_mm = [0, 0, 900]\n" +
           lamp_keys;
}

std::string real_with_door(const std::string& door) {
    return "[rig]\nname = \"r\"\n[camera]\ndriver = \"v4l2\"\ndevice = \"cam\"\n" + door +
           "\n[lamps]\ndriver = \"gpio\"\n[lamps.gpio]\nchip = \"soc\"\n[[lamps.lamp]]\nname = \"a\"\nline = 1\n"
           "position_mm = [0, 0, 900]\n";
}

std::string problem(const std::string& toml) {
    try {
        parse_rig(toml, "rig.toml");
    } catch (const InputError& error) {
        EXPECT_FALSE(error.hint().empty());
        return error.what();
    }
    return "none";
}

TEST(Dose, IsReadOfLampsAndBudgets) {
    const RigDescription rig = parse_rig(
        simulated("[dose]\nobject_lux_s = 180000\nobject_uv_j_per_m2 = 5\nobject_ir_j_per_m2 = 6\ncapture_lux_s = 5e3\n"
                  "exempt = [\"ball\"]\n",
                  "illuminance_lux = 850\nuv_w_per_m2 = 0.01\nir_w_per_m2 = 0.2\n"),
        "rig.toml");
    EXPECT_EQ(rig.lamps[0].dose_per_s.lux_s, 850);
    EXPECT_EQ(rig.lamps[0].dose_per_s.uv_j_per_m2, 0.01);
    EXPECT_EQ(rig.lamps[0].dose_per_s.ir_j_per_m2, 0.2);
    EXPECT_EQ(rig.dose.object_lux_s, 180000);
    EXPECT_EQ(rig.dose.object_uv_j_per_m2, 5);
    EXPECT_EQ(rig.dose.object_ir_j_per_m2, 6);
    EXPECT_EQ(rig.dose.capture_lux_s, 5000);
    EXPECT_THAT(rig.dose.exempt, ElementsAre("ball"));
}

TEST(Dose, IsNotLimitedWhereNothingIsSaid) {
    const RigDescription rig = parse_rig(simulated(""), "rig.toml");
    EXPECT_FALSE(rig.dose.object_lux_s || rig.dose.capture_lux_s);
    EXPECT_THAT(rig.dose.exempt, ElementsAre("recalibration", "flat"));
}

TEST(Dose, BudgetsNeedLampsThatSayWhatTheyGive) {
    EXPECT_THAT(problem(simulated("[dose]\nobject_lux_s = 1\n")),
                HasSubstr("has object_lux_s, but lamp 'a' has no illuminance_lux"));
    EXPECT_THAT(problem(simulated("[dose]\nobject_uv_j_per_m2 = 1\n", "illuminance_lux = 1\n")),
                HasSubstr("no uv_w_per_m2"));
    EXPECT_THAT(problem(simulated("[dose]\nobject_lux_s = 0\n", "illuminance_lux = 1\n")), HasSubstr("object_lux_s"));
    EXPECT_THAT(problem(simulated("[dose]\nobjekt_lux_s = 1\n")), HasSubstr("object_lux_s"));
}

TEST(Door, IsALineOfTheLampsChipUnlessAnotherIsNamed) {
    const RigDescription rig = parse_rig(real_with_door("[door]\nline = \"GPIO21\"\nactive_low = true\n"), "rig.toml");
    ASSERT_TRUE(rig.door);
    EXPECT_EQ(rig.door->chip, "soc");
    EXPECT_EQ(rig.door->line, "GPIO21");
    EXPECT_TRUE(rig.door->active_low);
    EXPECT_EQ(parse_rig(real_with_door("[door]\nchip = \"hat\"\nline = 4\n"), "rig.toml").door->chip, "hat");
    EXPECT_FALSE(parse_rig(real_with_door(""), "rig.toml").door);
}

TEST(Door, OfARealRigHasALine) { EXPECT_THAT(problem(real_with_door("[door]\n")), HasSubstr("line is missing")); }

TEST(Door, OfASimulatedRigHasNone) {
    EXPECT_TRUE(parse_rig(simulated("[door]\n"), "rig.toml").door);
    EXPECT_THAT(problem(simulated("[door]\nline = 3\n")), HasSubstr("line does not belong to a simulated rig's door"));
}

TEST(Faults, AreTheSimulatorsToRead) {
    EXPECT_EQ(parse_rig(simulated("[sim]\nfaults = \"drop@3\"\n"), "rig.toml").sim.faults, "drop@3");
}

}  // namespace
}  // namespace darkbox
