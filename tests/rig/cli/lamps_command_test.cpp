#include <gmock/gmock.h>

#include <fstream>

#include "tests/rig/cli/program.h"
#include "tests/support/test_data.h"

namespace darkbox {
namespace {

using test::darkbox_program;
using testing::HasSubstr;

/// A rig of one lamp, on a chip that no machine has; and a socket that nobody listens at.
class LampsCommand : public testing::Test {
protected:
    void SetUp() override {
        std::ofstream(rig_) << "[rig]\nname = \"bench\"\n[camera]\ndriver = \"v4l2\"\ndevice = \"/dev/video0\"\n"
                               "[lamps]\ndriver = \"gpio\"\n[lamps.gpio]\nchip = \"darkbox-no-such-chip\"\n"
                               "[[lamps.lamp]]\nname = \"only\"\nline = 4\nposition_mm = [0, 0, 900]\nmax_on_s = 2\n";
    }

    test::ProgramResult lamps(std::vector<std::string> arguments) const {
        arguments.insert(arguments.begin(), "lamps");
        arguments.insert(arguments.end(), {"--socket", (folder_.path() / "nobody.sock").string()});
        return darkbox_program(arguments);
    }

    test::TemporaryFolder folder_;
    std::string rig_ = (folder_.path() / "rig.toml").string();
};

TEST_F(LampsCommand, ListsTheLampsOfADescription) {
    const auto result = lamps({"list", "--rig", rig_});
    EXPECT_EQ(result.status, 0) << result.err;
    EXPECT_THAT(result.out, HasSubstr("only"));
}

TEST_F(LampsCommand, AsksForADaemonOrARig) {
    for (const char* command : {"list", "dark"}) {
        const auto result = lamps({command});
        EXPECT_EQ(result.status, 1);
        EXPECT_THAT(result.err, HasSubstr("no darkboxd answers, and no rig is given"));
        EXPECT_THAT(result.err, HasSubstr("--rig rig.toml"));
    }
}

TEST_F(LampsCommand, NeverCallsLampsDarkThatItCannotReach) {
    const auto result = lamps({"dark", "--rig", rig_});
    EXPECT_EQ(result.status, 1);
    EXPECT_THAT(result.err, HasSubstr("darkbox-no-such-chip"));
    EXPECT_EQ(result.out, "");
}

TEST_F(LampsCommand, LightsOnlyALampThatIsThereForATimeThatItBears) {
    const auto unknown = lamps({"on", "other", "--rig", rig_});
    EXPECT_EQ(unknown.status, 1);
    EXPECT_THAT(unknown.err, HasSubstr("there is no lamp 'other'"));
    const auto too_long = lamps({"on", "only", "--seconds", "2", "--rig", rig_});
    EXPECT_EQ(too_long.status, 1);
    EXPECT_THAT(too_long.err, HasSubstr("is to be lit for 2 s; allowed: above 0 to 1.8"));
}

}  // namespace
}  // namespace darkbox
