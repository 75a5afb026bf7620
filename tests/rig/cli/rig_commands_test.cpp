#include "rig/cli/rig_commands.h"

#include <gmock/gmock.h>

#include "acquisition/frame/error.h"

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

}  // namespace
}  // namespace darkbox
