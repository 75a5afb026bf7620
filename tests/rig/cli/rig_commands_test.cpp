#include "rig/cli/rig_commands.h"

#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>

#include "acquisition/frame/error.h"
#include "processing/calibration/rig_plan.h"
#include "rig/cli/described_lamps.h"
#include "rig/description/rig_description.h"
#include "tests/support/test_data.h"

namespace darkbox {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

TEST(Plan, NamesLampsBetweenCommas) {
    EXPECT_THAT(lamps_of_plan("all"), IsEmpty());
    EXPECT_THAT(lamps_of_plan("lamp-02"), ElementsAre("lamp-02"));
    EXPECT_THAT(lamps_of_plan("lamp-02,lamp-01"), ElementsAre("lamp-02", "lamp-01"));
    EXPECT_THROW(lamps_of_plan(""), InputError);
    EXPECT_THROW(lamps_of_plan("a,,b"), InputError);
}

TEST(SessionName, IsANameOrAPathIntoTheDaemonsFolder) {
    EXPECT_EQ(name_in_folder("vase", "/srv/sessions"), "vase");
    EXPECT_EQ(name_in_folder("/srv/sessions/vase", "/srv/sessions"), "vase");
    EXPECT_EQ(name_in_folder("/srv/sessions/vase/", "/srv/sessions"), "vase");
    EXPECT_EQ(name_in_folder("/srv/x/../sessions/vase", "/srv/sessions"), "vase");
    EXPECT_THROW(name_in_folder("/srv/vase", "/srv/sessions"), InputError);
    EXPECT_THROW(name_in_folder("/srv/sessions/../vase", "/srv/sessions"), InputError);
}

TEST(LampsOfAPlan, MakeARigThatCanBeRead) {
    RigPlanOptions options;
    options.lamps = 5;
    const RigPlan plan = plan_rig(options);
    const RigDescription rig =
        parse_rig("[rig]\nname = \"planned\"\n[lamps]\ndriver = \"sim\"\n\n" + lamps_toml(plan.positions_mm), "plan");
    ASSERT_EQ(rig.lamps.size(), 5u);
    for (std::size_t i = 0; i < 5; ++i)
        for (std::size_t axis = 0; axis < 3; ++axis)
            EXPECT_NEAR(rig.lamps[i].position_mm[axis], plan.positions_mm[i][static_cast<Eigen::Index>(axis)], 0.051);
}

TEST(DescribedLamps, AreReadFromTheSessionsOwnDescription) {
    const test::TemporaryFolder folder;
    EXPECT_FALSE(described_lamps(folder.path()));
    std::filesystem::create_directories(folder.path() / "data");
    std::ofstream(folder.path() / "data/rig.toml") << simulated_rig_toml(6);
    const auto described = described_lamps(folder.path());
    ASSERT_TRUE(described);
    EXPECT_EQ(described->rig.name, "simulated-6");
    ASSERT_EQ(described->lights.size(), 6u);
    EXPECT_EQ(described->rig.lamps.front(), "lamp-01");
    EXPECT_NEAR(described->lights.front().direction.norm(), 1, 1e-9);
    std::ofstream(folder.path() / "data/rig.toml") << "nothing";
    EXPECT_FALSE(described_lamps(folder.path()));
}

}  // namespace
}  // namespace darkbox
