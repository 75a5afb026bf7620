// `darkbox lamps flash` with the real image on the emulated board; what writes the chip through its loader is played by
// scripts that note what they were asked.
#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>

#include "acquisition/frame/error.h"
#include "rig/lamps/lamp_controller.h"
#include "rig/lamps/lamp_image.h"
#include "tests/firmware/board_fixture.h"
#include "tests/firmware/emulator/usb_testbed.h"
#include "tests/support/child_process.h"
#include "tests/support/test_data.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;
using lampctl::HostBoard;
using testing::HasSubstr;

class LampsFlash : public testing::Test {
protected:
    LampsFlash() {
        fs::create_directory(bin_);
        for (const char* programmer : {"dfu-programmer", "avrdude"}) {
            std::ofstream(bin_ / programmer) << "#!/bin/sh\necho \"$*\" >> \"" << log_.string() << "\"\n";
            fs::permissions(bin_ / programmer, fs::perms::owner_all);
        }
        path_ = std::getenv("PATH");
        setenv("PATH", (bin_.string() + ":" + path_).c_str(), 1);
    }
    ~LampsFlash() override { setenv("PATH", path_.c_str(), 1); }

    struct Ended {
        int status;
        std::string out;
        std::string err;
    };
    Ended flash(std::vector<std::string> arguments) const {
        arguments.insert(arguments.begin(), {DARKBOX_PROGRAM, "lamps", "flash"});
        test::ChildProcess process(arguments, folder_.path() / "flash");
        const int status = process.wait();
        return {status, process.out(), process.err()};
    }
    std::string programmed() const {
        std::ifstream in(log_);
        return {std::istreambuf_iterator<char>(in), {}};
    }
    std::string changed_image(const std::string& from, const std::string& to) const {
        std::ifstream in(DARKBOX_LAMP_HEX);
        std::string text(std::istreambuf_iterator<char>(in), {});
        text.replace(text.find(from), from.size(), to);
        const fs::path file = folder_.path() / "changed.hex";
        std::ofstream(file) << text;
        return file.string();
    }

    test::TemporaryFolder folder_;
    const fs::path bin_ = folder_.path() / "bin";
    const fs::path log_ = folder_.path() / "programmed.txt";
    std::string path_;
};

TEST_F(LampsFlash, TheImageSaysWhatItIs) {
    const LampImage image = read_lamp_image(DARKBOX_LAMP_HEX);
    EXPECT_EQ(image.mark.protocol_major, lamp_protocol::version_major);
    EXPECT_GT(image.bytes.size(), 4096U);
}

TEST_F(LampsFlash, WhatIsNoWholeImageIsNeverFlashed) {
    const auto refused = [&](const std::string& file, const char* why) {
        try {
            read_lamp_image(file);
            ADD_FAILURE() << "read " << why;
        } catch (const InputError& error) {
            EXPECT_THAT(error.what(), HasSubstr(why));
        }
    };
    refused(changed_image(":10", ":11"), "line 1 is damaged");
    refused(changed_image(":00000001FF", ""), "ends early");
    refused(DARKBOX_PROGRAM, "is damaged, or the file is no Intel HEX");
    const fs::path other = folder_.path() / "other.hex";
    std::ofstream(other) << ":0100000000FF\n:00000001FF\n";
    refused(other.string(), "no lamp controller's firmware");
    std::ofstream(other) << ":0170000000" << "8F\n:00000001FF\n";
    refused(other.string(), "where the chip's bootloader is");
    refused((folder_.path() / "absent.hex").string(), "cannot be read");
}

TEST_F(LampsFlash, ANewBoardGetsFirmwareAndIdentity) {
    if (!test::UsbTestbed::available()) GTEST_SKIP() << "runs under umockdev-wrapper";
    test::UsbTestbed bed;
    bed.plug_in(DARKBOX_LAMP_ELF, std::nullopt);
    const Ended ended = flash({DARKBOX_LAMP_HEX, "--serial", "LC-0042", "--label", "dome 64", "--lamps", "48"});
    ASSERT_EQ(ended.status, 0) << ended.err;
    EXPECT_THAT(ended.out, HasSubstr("'LC-0042' runs firmware 1.0 with 48 lamps"));
    EXPECT_THAT(programmed(), HasSubstr("atmega32u4 erase\natmega32u4 flash "));
    LampController board({.serial = "LC-0042"});
    EXPECT_EQ(board.info().lamps, 48);
    EXPECT_STREQ(board.identity().label, "dome 64");
}

TEST_F(LampsFlash, ByAvrdudeTheUserStartsTheBoard) {
    if (!test::UsbTestbed::available()) GTEST_SKIP() << "runs under umockdev-wrapper";
    test::UsbTestbed bed;
    bed.plug_in(DARKBOX_LAMP_ELF, std::nullopt);
    const Ended ended = flash({DARKBOX_LAMP_HEX, "--serial", "LC-0042", "--programmer", "avrdude"});
    ASSERT_EQ(ended.status, 0) << ended.err;
    EXPECT_EQ(programmed(), "-c flip1 -p m32u4 -U flash:w:" DARKBOX_LAMP_HEX ":i\n");
    EXPECT_THAT(ended.err, HasSubstr("press the board's reset button"));
    EXPECT_THAT(ended.out, HasSubstr("'LC-0042' runs firmware"));
}

/// What avrdude itself makes of these words: it looks for the chip's loader, and finds none here.
TEST_F(LampsFlash, AvrdudeUnderstandsWhatItIsTold) {
    if (!test::UsbTestbed::available()) GTEST_SKIP() << "runs under umockdev-wrapper";
    if (!fs::exists("/usr/bin/avrdude")) GTEST_SKIP() << "avrdude is not installed";
    test::UsbTestbed bed;
    fs::remove(bin_ / "avrdude");
    const Ended ended = flash({DARKBOX_LAMP_HEX, "--serial", "LC-0042", "--programmer", "avrdude"});
    EXPECT_EQ(ended.status, 1);
    EXPECT_THAT(ended.err, HasSubstr("no matching USB device found"));
    EXPECT_THAT(ended.err,
                HasSubstr("avrdude -c flip1 -p m32u4 -U flash:w:" DARKBOX_LAMP_HEX ":i ended with status 1"));
    EXPECT_THAT(ended.err, HasSubstr("bootloader button"));
}

TEST_F(LampsFlash, AMissingProgrammerIsNamed) {
    if (!test::UsbTestbed::available()) GTEST_SKIP() << "runs under umockdev-wrapper";
    test::UsbTestbed bed;
    setenv("PATH", (bin_ / "empty").c_str(), 1);
    for (const std::string programmer : {"dfu-programmer", "avrdude"}) {
        const Ended ended = flash({DARKBOX_LAMP_HEX, "--programmer", programmer});
        EXPECT_EQ(ended.status, 1);
        EXPECT_THAT(ended.err, HasSubstr("apt-get install " + programmer));
    }
}

TEST_F(LampsFlash, AnotherBoardThanTheNamedOneIsLeftAlone) {
    if (!test::UsbTestbed::available()) GTEST_SKIP() << "runs under umockdev-wrapper";
    test::UsbTestbed bed;
    bed.plug_in(DARKBOX_LAMP_ELF, HostBoard::some_identity());
    const Ended ended = flash({DARKBOX_LAMP_HEX, "--serial", "LC-0042"});
    EXPECT_EQ(ended.status, 1);
    EXPECT_THAT(ended.err, HasSubstr("no lamp controller 'LC-0042' is plugged in; there is 'HOST-1'"));
    EXPECT_EQ(programmed(), "");
}

}  // namespace
}  // namespace darkbox
