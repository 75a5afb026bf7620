#include "rig/lamps/gpio_lamps.h"

#include <gmock/gmock.h>

#include <stdexcept>

#include "tests/rig/lamps/recorded_lines.h"

namespace darkbox {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::SizeIs;

RigDescription direct_rig(int lamps) {
    RigDescription rig;
    rig.lamps_driver = "gpio";
    rig.gpio.chip = "bench";
    for (int i = 0; i < lamps; ++i) {
        LampDescription lamp;
        lamp.name = "lamp-" + std::to_string(i);
        lamp.line = std::to_string(10 + i);
        lamp.active_low = i == 1;
        lamp.max_on = Seconds(60);
        rig.lamps.push_back(lamp);
    }
    return rig;
}

RigDescription multiplexed_rig() {
    RigDescription rig = direct_rig(8);
    for (int i = 0; i < 8; ++i) rig.lamps[static_cast<std::size_t>(i)].address = 7 - i;
    rig.gpio.multiplexer = {.address_lines = {"A0", "A1", "A2"}, .enable_line = "EN", .enable_active_low = true};
    return rig;
}

struct Bench {
    explicit Bench(const RigDescription& rig) : guardian(gpio_request(rig), chip.request()), lamps(rig, guardian) {}

    test::RecordedChip chip;
    LampGuardian guardian;
    GpioLamps lamps;
};

TEST(GpioRequest, NamesALineForEachLampWithItsPolarity) {
    const GpioRequest request = gpio_request(direct_rig(2));
    EXPECT_EQ(request.chip, "bench");
    ASSERT_THAT(request.lines, SizeIs(2));
    EXPECT_EQ(request.lines[1].line, "11");
    EXPECT_FALSE(request.lines[0].active_low);
    EXPECT_TRUE(request.lines[1].active_low);
}

TEST(GpioRequest, NamesADecodersInputsEnableFirst) {
    const GpioRequest request = gpio_request(multiplexed_rig());
    ASSERT_THAT(request.lines, SizeIs(4));
    EXPECT_EQ(request.lines[0].line, "EN");
    EXPECT_TRUE(request.lines[0].active_low);
    EXPECT_EQ(request.lines[3].line, "A2");
    EXPECT_FALSE(request.lines[3].active_low);
}

TEST(GpioLamps, LightOneLampAfterAllWereDark) {
    Bench bench(direct_rig(3));
    bench.lamps.light(LampId{0}, 1.0);
    EXPECT_EQ(bench.chip.record().active, 1u);
    bench.lamps.light(LampId{2}, 1.0);
    EXPECT_EQ(bench.chip.record().active, 4u);
    bench.lamps.dark();
    EXPECT_EQ(bench.chip.record().active, 0u);
    for (const std::uint64_t value : bench.chip.record().all_sets())
        EXPECT_EQ(value & (value - 1), 0u) << "two lamps at once";
    EXPECT_THAT(bench.chip.record().all_sets(), ElementsAre(0, 1, 0, 0, 4, 0, 0));
}

TEST(GpioLamps, ChangeADecodersAddressOnlyWhileItIsDisabled) {
    Bench bench(multiplexed_rig());
    for (const std::uint32_t lamp : {5U, 2U, 7U, 0U}) {
        bench.lamps.light(LampId{lamp}, 1.0);
        EXPECT_EQ(bench.chip.record().active, ((7 - lamp) << 1 | 1)) << "lamp " << lamp;
    }
    bench.lamps.dark();
    EXPECT_EQ(bench.chip.record().active, 0u);
    std::uint64_t before = 0;
    for (const std::uint64_t now : bench.chip.record().all_sets()) {
        EXPECT_TRUE((before >> 1) == (now >> 1) || ((before | now) & 1) == 0) << before << " to " << now;
        before = now;
    }
}

TEST(GpioLamps, KnowOnAndOffAlone) {
    Bench bench(direct_rig(3));
    EXPECT_THROW(bench.lamps.light(LampId{0}, 0.5), std::invalid_argument);
    EXPECT_THROW(bench.lamps.light(LampId{3}, 1.0), std::invalid_argument);
    EXPECT_EQ(bench.chip.record().active, 0u);
}

TEST(GpioLamps, AreDarkAfterAnException) {
    const RigDescription rig = direct_rig(3);
    test::RecordedChip chip;
    LampGuardian guardian(gpio_request(rig), chip.request());
    EXPECT_THROW(
        {
            GpioLamps lamps(rig, guardian);
            lamps.light(LampId{1}, 1.0);
            EXPECT_EQ(chip.record().active, 2u);
            throw std::runtime_error("anything");
        },
        std::runtime_error);
    EXPECT_EQ(chip.record().active, 0u);
    EXPECT_TRUE(chip.record().held) << "darkness is certain only while the lines are held";
}

TEST(GpioLamps, DarkenThemselvesAfterTheirLongestTime) {
    RigDescription rig = direct_rig(2);
    rig.lamps[0].max_on = Seconds(0.05);
    Bench bench(rig);
    bench.lamps.light(LampId{0}, 1.0);
    EXPECT_TRUE(test::comes_true([&] { return bench.chip.record().active == 0; }));
    ASSERT_THAT(bench.lamps.health().problems, SizeIs(1));
    EXPECT_THAT(bench.lamps.health().problems[0], HasSubstr("max_on_s"));
    EXPECT_THROW(bench.lamps.light(LampId{1}, 1.0), DeviceError) << "what happened must be told";
    EXPECT_EQ(bench.chip.record().active, 0u);
    bench.lamps.dark();
    EXPECT_TRUE(bench.lamps.health().problems.empty());
    bench.lamps.light(LampId{1}, 1.0);
    EXPECT_EQ(bench.chip.record().active, 2u);
}

TEST(GpioLamps, LitAgainAndAgainAreLitOn) {
    RigDescription rig = direct_rig(1);
    rig.lamps[0].max_on = Seconds(0.2);
    Bench bench(rig);
    const auto light = [&] { bench.lamps.light(LampId{0}, 1.0); };
    EXPECT_THROW(
        {
            for (int i = 0; i < 20'000; ++i) {
                light();
                std::this_thread::sleep_for(std::chrono::milliseconds(5));
            }
        },
        DeviceError);
    EXPECT_EQ(bench.chip.record().active, 0u);
}

TEST(GpioLamps, ComeBackWithTheirChip) {
    Bench bench(direct_rig(2));
    bench.lamps.light(LampId{0}, 1.0);
    bench.chip.record().plugged = false;
    EXPECT_THROW(bench.lamps.light(LampId{1}, 1.0), DeviceError);
    EXPECT_THROW(bench.lamps.dark(), DeviceError) << "nobody knows";
    EXPECT_FALSE(bench.lamps.health().reachable);
    bench.chip.record().plugged = true;
    bench.lamps.dark();
    EXPECT_EQ(bench.chip.record().active, 0u);
    bench.lamps.light(LampId{1}, 1.0);
    EXPECT_EQ(bench.chip.record().active, 2u);
}

TEST(GpioLamps, TellThatTheirChipIsMissing) {
    const RigDescription rig = direct_rig(1);
    test::RecordedChip chip;
    chip.record().plugged = false;
    LampGuardian guardian(gpio_request(rig), chip.request());
    try {
        GpioLamps lamps(rig, guardian);
        FAIL() << "opened a chip that is not there";
    } catch (const DeviceError& error) {
        EXPECT_THAT(error.what(), HasSubstr("no GPIO chip"));
        EXPECT_EQ(error.hint(), "plug it in");
    }
    chip.record().plugged = true;
    EXPECT_NO_THROW(GpioLamps(rig, guardian)) << "a chip may come later";
}

}  // namespace
}  // namespace darkbox
