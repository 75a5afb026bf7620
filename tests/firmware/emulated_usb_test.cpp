// The image that is flashed, under an emulated USB host that plays what is legal and what is not.
#include <gmock/gmock.h>

#include <random>

#include "tests/firmware/board_fixture.h"
#include "tests/firmware/emulator/emulated_host.h"

namespace darkbox {
namespace {

using namespace lamp_protocol;
using lampctl::HostBoard;
using test::ControlRequest;
using test::EmulatedBoard;
using test::EmulatedHost;
using test::outcome;
using testing::ElementsAre;
using Handshake = EmulatedBoard::Handshake;
using Bytes = std::vector<std::uint8_t>;

class EmulatedUsb : public testing::Test {
protected:
    EmulatedUsb() { host.enumerate(); }

    Bytes descriptor(std::uint16_t which, std::uint16_t length) {
        return host.control({0x80, 6, which, 0, length}).bytes;
    }
    Handshake ask(const ControlRequest& request, const Bytes& data = {}) {
        return host.control(request, data).handshake;
    }
    /// After whatever was done to it, the board serves as it should.
    void expect_sound() {
        EXPECT_EQ(host.read<Info>(Request::info).magic, info_magic);
        EXPECT_EQ(outcome(host.command(Command::light, test::light({40}, 255))), Outcome::done);
        EXPECT_EQ(board.lamps().lit, std::uint64_t{1} << 40);
        EXPECT_EQ(outcome(host.command(Command::dark)), Outcome::done);
        EXPECT_EQ(board.lamps().lit, 0U);
    }

    EmulatedBoard board{DARKBOX_LAMP_ELF, HostBoard::some_identity()};
    EmulatedHost host{board};
};

TEST_F(EmulatedUsb, DescribesItself) {
    const Bytes device = descriptor(0x0100, 64);
    EXPECT_THAT(device, ElementsAre(18, 1, 0, 2, 0xFF, 0, 0, 64, 0x09, 0x12, 0x01, 0, 0, 1, 1, 2, 3, 1));
    EXPECT_EQ(descriptor(0x0100, 8), Bytes(device.begin(), device.begin() + 8));
    const Bytes whole = descriptor(0x0200, 255);
    ASSERT_EQ(whole.size(), 32U);
    EXPECT_EQ(whole[2], 32);
    EXPECT_EQ(whole[9 + 9 + 2], command_endpoint);
    EXPECT_EQ(whole[9 + 9 + 7 + 2], event_endpoint);
    const auto text = [&](std::uint16_t index) {
        const Bytes raw = descriptor(static_cast<std::uint16_t>(0x0300 | index), 255);
        std::string plain;
        for (std::size_t i = 2; i < raw.size(); i += 2) plain += static_cast<char>(raw[i]);
        return plain;
    };
    EXPECT_EQ(text(1), "darkbox");
    EXPECT_EQ(text(2), "darkbox lamp controller");
    EXPECT_EQ(text(3), "HOST-1");
    EXPECT_EQ(ask({0x80, 6, 0x0304, 0, 255}), Handshake::stall);
    EXPECT_EQ(ask({0x80, 6, 0x0600, 0, 10}), Handshake::stall) << "no high speed";
}

TEST_F(EmulatedUsb, AnswersStandardRequests) {
    EXPECT_THAT(host.control({0x80, 0, 0, 0, 2}).bytes, ElementsAre(1, 0));
    EXPECT_THAT(host.control({0x80, 8, 0, 0, 1}).bytes, ElementsAre(1));
    EXPECT_THAT(host.control({0x81, 10, 0, 0, 1}).bytes, ElementsAre(0));
    EXPECT_EQ(ask({0x01, 11, 0, 0, 0}), Handshake::ack);
    EXPECT_EQ(ask({0x00, 9, 2, 0, 0}), Handshake::stall) << "there is one configuration";
    EXPECT_EQ(ask({0x00, 5, 200, 0, 0}), Handshake::stall);
    EXPECT_EQ(ask({0x00, 7, 0x0100, 0, 18}, Bytes(18)), Handshake::stall);
    expect_sound();
}

TEST_F(EmulatedUsb, HaltsAndClearsEndpoints) {
    for (const std::uint8_t endpoint : {command_endpoint, event_endpoint}) {
        EXPECT_THAT(host.control({0x82, 0, 0, endpoint, 2}).bytes, ElementsAre(0, 0));
        EXPECT_EQ(ask({0x02, 3, 0, endpoint, 0}), Handshake::ack);
        board.run_ms(1);
        EXPECT_THAT(host.control({0x82, 0, 0, endpoint, 2}).bytes, ElementsAre(1, 0));
        EXPECT_EQ(ask({0x02, 1, 0, endpoint, 0}), Handshake::ack);
        board.run_ms(1);
        expect_sound();
    }
    EXPECT_EQ(ask({0x02, 3, 0, command_endpoint, 0}), Handshake::ack);
    board.run_ms(1);
    EXPECT_EQ(host.out(command_endpoint, {1}), Handshake::stall);
    EXPECT_EQ(ask({0x02, 1, 0, command_endpoint, 0}), Handshake::ack);
    EXPECT_EQ(ask({0x02, 3, 0, 3, 0}), Handshake::stall) << "there is no endpoint 3";
    expect_sound();
}

TEST_F(EmulatedUsb, LightsExactlyTheLampsAsked) {
    for (unsigned lamp = 0; lamp < most_lamps; ++lamp) {
        ASSERT_EQ(outcome(host.command(Command::light, test::light({lamp}, 255))), Outcome::done);
        ASSERT_EQ(board.lamps().lit, std::uint64_t{1} << lamp);
    }
    for (const unsigned level : {1U, 2U, 128U, 254U, 255U}) {
        host.command(Command::light, test::light({9}, static_cast<std::uint8_t>(level)));
        EXPECT_EQ(board.lamps().level, level);
    }
    EXPECT_EQ(ask({EmulatedHost::vendor_out, static_cast<std::uint8_t>(Request::dark), 0, 0, 0}), Handshake::ack);
    EXPECT_EQ(board.lamps().lit, 0U);
    EXPECT_EQ(host.status().activity, Activity::dark);
}

TEST_F(EmulatedUsb, UnknownVendorRequestsStall) {
    for (unsigned request = 0; request < 256; ++request) {
        const auto name = static_cast<Request>(request);
        const bool known = name == Request::info || name == Request::status || name == Request::identity;
        const auto number = static_cast<std::uint8_t>(request);
        EXPECT_EQ(ask({EmulatedHost::vendor_in, number, 0, 0, 8}), known ? Handshake::ack : Handshake::stall);
        if (name == Request::dark) continue;
        EXPECT_EQ(ask({EmulatedHost::vendor_out, number, 0, 0, 0}), Handshake::stall) << request;
        EXPECT_EQ(ask({EmulatedHost::vendor_out, number, 0, 0, 5}, Bytes(5)), Handshake::stall) << request;
    }
    expect_sound();
}

TEST_F(EmulatedUsb, StoresAnIdentity) {
    Identity wanted = HostBoard::some_identity();
    std::strcpy(wanted.serial, "LC-0042");
    wanted.lamps = 48;
    const auto store = [&](const Identity& identity, std::uint16_t key) {
        const auto* bytes = reinterpret_cast<const std::uint8_t*>(&identity);
        return ask({EmulatedHost::vendor_out, static_cast<std::uint8_t>(Request::set_identity), key, 0, 48},
                   {bytes, bytes + 48});
    };
    EXPECT_EQ(store(lampctl::sealed(wanted), 0), Handshake::stall) << "without the key";
    EXPECT_EQ(store(wanted, identity_key), Handshake::stall) << "with a wrong CRC";
    host.command(Command::light, test::light({1}));
    EXPECT_EQ(store(lampctl::sealed(wanted), identity_key), Handshake::stall) << "while lit";
    host.command(Command::dark);
    EXPECT_EQ(store(lampctl::sealed(wanted), identity_key), Handshake::ack);
    EXPECT_EQ(host.read<Info>(Request::info).lamps, 48);
    EXPECT_STREQ(host.read<Identity>(Request::identity).serial, "LC-0042");
    EXPECT_EQ(outcome(host.command(Command::light, test::light({50}))), Outcome::no_such_lamp);
}

TEST_F(EmulatedUsb, EverySizeOfPacketIsTaken) {
    for (unsigned size = 0; size <= 64; ++size) {
        ASSERT_EQ(host.out(command_endpoint, Bytes(size, 0x55)), Handshake::ack) << size;
        const auto reply = host.next_event(20);
        ASSERT_TRUE(reply) << size;
        EXPECT_EQ(outcome(*reply), size < 4 ? Outcome::bad_length : Outcome::bad_crc);
    }
    expect_sound();
}

TEST_F(EmulatedUsb, AHostThatNeverReadsLosesEventsOnly) {
    const Bytes heartbeat = lampctl::packet_of(Command::heartbeat, 1, nullptr, 0);
    for (int i = 0; i < 40; ++i) ASSERT_EQ(host.out(command_endpoint, heartbeat), Handshake::ack);
    board.run_ms(5);
    EXPECT_GE(host.status().events_lost, 30);
    while (host.next_event(2)) {
    }
    expect_sound();
}

TEST_F(EmulatedUsb, AbandonedTransfersLeaveNothingBehind) {
    for (int i = 0; i < 20; ++i) {
        board.setup({EmulatedHost::vendor_out, static_cast<std::uint8_t>(Request::set_identity), 0xE7, 0x1D, 0, 0, 48,
                     0});  // its data never come
        board.run_us(300);
        EXPECT_EQ(host.control({0x80, 8, 0, 0, 1}).bytes, Bytes{1});
    }
    expect_sound();
}

TEST_F(EmulatedUsb, NothingAnyHostSendsLightsMoreThanOneLamp) {
    std::mt19937 random(4711);
    const auto any = [&](unsigned below) {
        return static_cast<std::uint8_t>(std::uniform_int_distribution<unsigned>(0, below - 1)(random));
    };
    bool crowded = false;
    board.on_lamps = [&](const test::LampsSeen& seen) { crowded |= (seen.lit & (seen.lit - 1)) != 0; };
    for (int i = 0; i < 1500; ++i) {
        Bytes data(any(65));
        for (std::uint8_t& byte : data) byte = any(256);
        switch (any(5)) {
            case 0:
                host.out(command_endpoint, data, 2);
                break;
            case 1: {  // a right packet of anything
                data.resize(any(61));
                host.out(command_endpoint,
                         lampctl::packet_of(static_cast<Command>(any(20)), any(256), data.data(), data.size()), 2);
                break;
            }
            case 2: {
                const LightCommand light = test::light({any(64)}, any(255));
                host.out(command_endpoint, lampctl::packet_of(Command::light, 0, &light, sizeof light), 2);
                break;
            }
            case 3:
                host.next_event(1);
                break;
            default: {
                ControlRequest request{any(256), any(32), any(256), any(4), static_cast<std::uint16_t>(data.size())};
                const bool address = (request.type & 0x7F) == 0 && request.request == 5;
                if (address || (request.type & 0x80) != 0) request.length = 0;
                host.control({request.type, request.request, request.value, request.index,
                              static_cast<std::uint16_t>((request.type & 0x80) != 0 ? 8 : data.size())},
                             data);
            }
        }
        ASSERT_FALSE(crowded) << "after " << i;
    }
    host.bus_reset();
    host.enumerate();
    host.command(Command::clear_faults, ClearCommand{0xFF, {}});
    expect_sound();
    EXPECT_EQ(board.resets(), 0U) << "the watchdog bit";
    std::printf("stack: %u of %u bytes used at most; %u never touched\n", board.stack_room() - board.untouched_stack(),
                board.stack_room(), board.untouched_stack());
    EXPECT_GE(board.untouched_stack(), 512U);
}

}  // namespace
}  // namespace darkbox
