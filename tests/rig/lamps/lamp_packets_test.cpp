#include "rig/lamps/lamp_packets.h"

#include <gmock/gmock.h>

#include "rig/lamps/device_clock.h"
#include "tests/rig/lamps/lamp_packets_input.h"
#include "tests/support/fuzz_corpus.h"

namespace darkbox {
namespace {

using namespace lamp_protocol;
using namespace std::chrono_literals;
using testing::HasSubstr;

TEST(LampPackets, OtherSizesAndValuesAreNone) {
    Event event{};
    event.kind = EventKind::step;
    event.lamp = 5;
    LampBytes bytes = lamp_payload(event);
    EXPECT_TRUE(parse_lamp_event(bytes));
    for (std::size_t size = 0; size < 64; ++size)
        if (size != sizeof(Event)) {
            EXPECT_FALSE(parse_lamp_event(LampBytes(size, 1)));
        }
    event.detail = most_steps;
    EXPECT_FALSE(parse_lamp_event(lamp_payload(event)));
    event.detail = 0;
    event.lamp = most_lamps;
    EXPECT_FALSE(parse_lamp_event(lamp_payload(event)));
    Info info{};
    EXPECT_FALSE(parse_lamp_info(lamp_payload(info)));
    info.magic = info_magic;
    EXPECT_TRUE(parse_lamp_info(lamp_payload(info)));
}

TEST(LampPackets, AnotherVersionIsRefusedInWords) {
    Info info{};
    info.protocol_major = version_major;
    info.protocol_minor = version_minor;
    EXPECT_FALSE(version_refusal(info));
    info.protocol_minor = version_minor + 1;
    EXPECT_FALSE(version_refusal(info)) << "a newer board knows what this host says";
    info.protocol_major = version_major + 1;
    ASSERT_TRUE(version_refusal(info));
    EXPECT_THAT(*version_refusal(info), HasSubstr("version 2.1 of the lamp protocol, this darkbox version 1.0"));
}

TEST(DeviceClock, TheTightestExchangeCounts) {
    DeviceClock clock;
    EXPECT_FALSE(clock.map(5));
    const TimePoint start{1000s};
    clock.exchange(start, start + 10ms, 0xFFFF'FF00);  // shortly before the stamps wrap
    EXPECT_EQ(clock.map(0xFFFF'FF00)->time, start + 5ms);
    EXPECT_EQ(clock.map(0xFFFF'FF00)->uncertainty, 5ms);
    clock.exchange(start + 1s, start + 1s + 2ms, 0xFFFF'FF00 + 1'000'000U);
    const auto later = clock.map(0xFFFF'FF00 + 2'000'000U);
    EXPECT_EQ(later->time, start + 2s + 1ms);
    EXPECT_EQ(later->uncertainty, 1ms + 100us) << "a second older, and the crystals may have drifted";
}

TEST(LampPacketsFuzz, InputsMadeFromTheCorpusHold) {
    const auto corpus = test::read_corpus(DARKBOX_FUZZ_CORPUS);
    ASSERT_GE(corpus.size(), 3U);
    test::FuzzGenerator generator(corpus);
    for (long i = 0, inputs = test::fuzz_inputs(200'000); i < inputs; ++i) {
        const auto input = generator.next();
        ASSERT_NO_THROW(test::play_to_lamp_packets(input.data(), input.size())) << "input " << i;
    }
}

}  // namespace
}  // namespace darkbox
