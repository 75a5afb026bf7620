#include "rig/cli/rig_commands.h"

#include <gmock/gmock.h>

#include "acquisition/frame/error.h"
#include "processing/calibration/rig_plan.h"
#include "rig/description/rig_description.h"

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

}  // namespace
}  // namespace darkbox
