#include "rig/lamps/door.h"

#include <gtest/gtest.h>

#include "acquisition/device/device_error.h"

namespace darkbox {
namespace {

/// A line whose level the test sets.
struct Wire {
    std::optional<std::string> asked_chip;
    GpioLine asked_line;
    bool high = false;
    bool gone = false;
};

class WiredInput final : public InputLine {
public:
    explicit WiredInput(Wire& wire) : wire_(wire) {}
    bool active() override {
        if (wire_.gone) throw DeviceError("read line GPIO21: No such device", "plug it in");
        return wire_.high != wire_.asked_line.active_low;
    }

private:
    Wire& wire_;
};

RequestInput request_of(Wire& wire) {
    return [&wire](const std::string& chip, const GpioLine& line) {
        wire.asked_chip = chip;
        wire.asked_line = line;
        return std::make_unique<WiredInput>(wire);
    };
}

TEST(GpioDoor, AsksForItsLine) {
    Wire wire;
    GpioDoor door({"pinctrl", "GPIO21", true}, request_of(wire));
    EXPECT_EQ(wire.asked_chip, "pinctrl");
    EXPECT_EQ(wire.asked_line.line, "GPIO21");
    EXPECT_TRUE(wire.asked_line.active_low);
}

TEST(GpioDoor, IsOpenWhileItsLineIsActive) {
    for (const bool active_low : {false, true}) {
        Wire wire;
        GpioDoor door({"pinctrl", "GPIO21", active_low}, request_of(wire));
        for (const bool high : {false, true}) {
            wire.high = high;
            EXPECT_EQ(door.is_open(), high != active_low);
            if (high != active_low)
                EXPECT_THROW(require_closed(door), DoorOpen);
            else
                EXPECT_NO_THROW(require_closed(door));
        }
    }
}

TEST(GpioDoor, ThatIsGoneIsAnError) {
    Wire wire;
    GpioDoor door({"pinctrl", "GPIO21", false}, request_of(wire));
    wire.gone = true;
    EXPECT_THROW(door.is_open(), DeviceError);
}

TEST(GpioDoor, NamesAChipThatIsNotThere) {
    EXPECT_THROW(request_gpio_input("no such chip", {"GPIO21", false}), DeviceError);
}

}  // namespace
}  // namespace darkbox
