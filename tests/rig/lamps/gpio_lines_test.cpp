#include "rig/lamps/gpio_lines.h"

#include <gmock/gmock.h>

#include "acquisition/device/device_error.h"

namespace darkbox {
namespace {

TEST(GpioLines, NameAChipThatIsNotThere) {
    try {
        request_gpio_lines({.chip = "darkbox-no-such-chip", .lines = {{"0", false}}});
        FAIL() << "there is no such chip";
    } catch (const DeviceError& error) {
        EXPECT_THAT(error.what(), testing::HasSubstr("darkbox-no-such-chip"));
        EXPECT_FALSE(error.hint().empty());
    }
}

}  // namespace
}  // namespace darkbox
