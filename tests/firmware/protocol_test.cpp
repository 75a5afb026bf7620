#include "firmware/protocol/lamp_protocol.h"

#include <gmock/gmock.h>

#include "firmware/lampctl/identity.h"
#include "tests/firmware/board_fixture.h"

namespace darkbox {
namespace {

using namespace lamp_protocol;
using lampctl::HostBoard;
using testing::ElementsAre;

TEST(LampProtocol, CrcIsTheStandardsOwn) { EXPECT_EQ(crc16("123456789", 9), 0x29B1); }

TEST(LampProtocol, PacketsAreWhatTheDocumentShows) {
    const auto heartbeat = lampctl::packet_of(Command::heartbeat, 7, nullptr, 0);
    EXPECT_THAT(heartbeat, ElementsAre(0x01, 0x07, 0xD9, 0x5E));
    const LightCommand lamp_9 = test::light({9}, 128);
    EXPECT_THAT(
        lampctl::packet_of(Command::light, 8, &lamp_9, sizeof lamp_9),
        ElementsAre(0x03, 0x08, 0x18, 0x52, 0x00, 0x02, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x80, 0x00, 0x00, 0x00));
    const ConfigureCommand settings = test::configure(100, 1);
    EXPECT_THAT(lampctl::packet_of(Command::configure, 9, &settings, sizeof settings),
                ElementsAre(0x04, 0x09, 0xDF, 0x00, 0x64, 0x00, 0x01, 0x00));
}

TEST(LampProtocol, StepsPackTwentyFourBits) {
    const Step step = test::step(5, 2000, 15000, step_trigger);
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(&step);
    EXPECT_THAT(std::vector<std::uint8_t>(bytes, bytes + 8), ElementsAre(0x45, 0xD0, 0x07, 0, 0xFF, 0x98, 0x3A, 0));
    EXPECT_EQ(read_24(step.exposure_us), 15000U);
    std::uint8_t most[3];
    write_24(most, longest_time_us);
    EXPECT_EQ(read_24(most), longest_time_us);
}

TEST(LampIdentity, EveryBitFlippedIsNoticed) {
    const Identity good = HostBoard::some_identity();
    EXPECT_TRUE(lampctl::valid(good));
    for (std::size_t bit = 0; bit < sizeof good * 8; ++bit) {
        Identity bad = good;
        reinterpret_cast<std::uint8_t*>(&bad)[bit / 8] ^= static_cast<std::uint8_t>(1U << bit % 8);
        EXPECT_FALSE(lampctl::valid(bad)) << "bit " << bit;
    }
}

TEST(LampIdentity, ErasedAndZeroedMemoryIsNone) {
    Identity identity;
    std::memset(&identity, 0xFF, sizeof identity);
    EXPECT_FALSE(lampctl::valid(identity));
    std::memset(&identity, 0, sizeof identity);
    EXPECT_FALSE(lampctl::valid(identity));
}

TEST(LampIdentity, FieldsOutOfRangeAreRefusedUnderARightCrc) {
    const auto refused = [](auto change) {
        Identity identity = HostBoard::some_identity();
        change(identity);
        return !lampctl::valid(lampctl::sealed(identity));
    };
    EXPECT_TRUE(refused([](Identity& i) { i.layout = 2; }));
    EXPECT_TRUE(refused([](Identity& i) { i.lamps = 0; }));
    EXPECT_TRUE(refused([](Identity& i) { i.lamps = 65; }));
    EXPECT_TRUE(refused([](Identity& i) { i.most_lit = 0; }));
    EXPECT_TRUE(refused([](Identity& i) { i.most_lit = 9; }));
    EXPECT_TRUE(refused([](Identity& i) { i.most_on_ms = 0; }));
    EXPECT_TRUE(refused([](Identity& i) { i.most_on_ms = 60001; }));
    EXPECT_TRUE(refused([](Identity& i) { i.hot = 901; }));
    EXPECT_TRUE(refused([](Identity& i) { i.serial[0] = 0; }));
    EXPECT_TRUE(refused([](Identity& i) { i.serial[2] = ' '; }));
    EXPECT_TRUE(refused([](Identity& i) { i.serial[11] = 'x'; }));
    EXPECT_TRUE(refused([](Identity& i) { i.label[1] = '\n'; }));
    EXPECT_FALSE(refused([](Identity& i) { std::strcpy(i.label, "dome 64, left"); }));
}

}  // namespace
}  // namespace darkbox
