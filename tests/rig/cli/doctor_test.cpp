#include "rig/cli/doctor.h"

#include <gmock/gmock.h>

#include <fstream>

#include "tests/support/test_data.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

RigDescription gpio_rig() {
    RigDescription rig;
    rig.camera.driver = "v4l2";
    rig.camera.device = "usb-ACME_Camera-video-index0";
    rig.lamps_driver = "gpio";
    rig.gpio.chip = "board";
    for (const char* line : {"GPIO5", "2"}) {
        LampDescription lamp;
        lamp.name = std::string("lamp on ") + line;
        lamp.line = line;
        rig.lamps.push_back(lamp);
    }
    return rig;
}

MachineSeen good_machine() {
    return {.user = "eva",
            .groups = {"eva", "video"},
            .chips = {{.device = "/dev/gpiochip0", .label = "board", .lines = {{"GPIO3"}, {"GPIO5"}, {""}}}},
            .camera = Access::open,
            .cameras = {"/dev/v4l/by-id/usb-ACME_Camera-video-index0"},
            .camera_group = "video",
            .udev_rules = true};
}

/// The one thing that is wrong.
Diagnosis only_bad(const Diagnoses& all) {
    Diagnosis found;
    int count = 0;
    for (const Diagnosis& d : all) {
        if (d.verdict != Verdict::bad) continue;
        found = d;
        ++count;
    }
    EXPECT_EQ(count, 1);
    EXPECT_FALSE(found.remedy.empty());
    return found;
}

TEST(Doctor, FindsNothingWrongWithAGoodMachine) {
    for (const Diagnosis& d : diagnose_camera(gpio_rig(), good_machine())) EXPECT_EQ(d.verdict, Verdict::good);
    for (const Diagnosis& d : diagnose_lamps(gpio_rig(), good_machine()))
        EXPECT_EQ(d.verdict, Verdict::good) << d.found;
}

TEST(Doctor, SaysWhatToDoWithoutACamera) {
    MachineSeen machine = good_machine();
    machine.camera = Access::absent;
    EXPECT_THAT(only_bad(diagnose_camera(gpio_rig(), machine)).remedy, HasSubstr("/dev/v4l/by-id/usb-ACME_Camera"));
    machine.cameras.clear();
    const Diagnosis none = only_bad(diagnose_camera(gpio_rig(), machine));
    EXPECT_THAT(none.found, HasSubstr("no camera is plugged in"));
    EXPECT_THAT(none.remedy, HasSubstr("plug it in"));
}

TEST(Doctor, SaysWhatToDoWithoutPermission) {
    MachineSeen machine = good_machine();
    machine.groups = {"eva"};
    machine.camera = Access::denied;
    EXPECT_THAT(only_bad(diagnose_camera(gpio_rig(), machine)).remedy, HasSubstr("usermod -aG video eva"));
    machine.camera_group = "root";  // nobody should join that
    EXPECT_THAT(only_bad(diagnose_camera(gpio_rig(), machine)).remedy, HasSubstr("udevadm trigger"));
    EXPECT_THAT(only_bad(diagnose_camera(gpio_rig(), machine)).remedy, HasSubstr("usermod -aG video eva"));
    machine.udev_rules = false;
    EXPECT_THAT(only_bad(diagnose_camera(gpio_rig(), machine)).remedy, HasSubstr("install darkbox-daemon"));
    machine.udev_rules = true;
    machine.chips = {{.device = "/dev/gpiochip0", .access = Access::denied}};
    const Diagnosis denied = only_bad(diagnose_lamps(gpio_rig(), machine));
    EXPECT_THAT(denied.found, HasSubstr("eva may not open /dev/gpiochip0"));
    EXPECT_THAT(denied.remedy, HasSubstr("usermod -aG darkbox eva"));
    machine.udev_rules = false;
    EXPECT_THAT(only_bad(diagnose_lamps(gpio_rig(), machine)).remedy, HasSubstr("darkbox-daemon"));
}

TEST(Doctor, SaysWhoHoldsALine) {
    MachineSeen machine = good_machine();
    machine.chips[0].lines[1].holder = "blinky";
    const Diagnosis busy = only_bad(diagnose_lamps(gpio_rig(), machine));
    EXPECT_THAT(busy.subject, HasSubstr("GPIO5"));
    EXPECT_THAT(busy.found, HasSubstr("blinky"));
    EXPECT_THAT(busy.remedy, HasSubstr("fuser -v /dev/gpiochip0"));
    machine.chips[0].lines[1].holder = "darkbox lamps";
    for (const Diagnosis& d : diagnose_lamps(gpio_rig(), machine)) EXPECT_EQ(d.verdict, Verdict::good);
}

TEST(Doctor, KnowsChipsAndLinesThatAreNotThere) {
    MachineSeen machine = good_machine();
    machine.chips[0].label = "another";
    EXPECT_THAT(only_bad(diagnose_lamps(gpio_rig(), machine)).remedy, HasSubstr("another"));
    machine.chips.clear();
    EXPECT_THAT(only_bad(diagnose_lamps(gpio_rig(), machine)).found, HasSubstr("no GPIO chip"));
    machine = good_machine();
    machine.chips[0].lines.resize(2);
    EXPECT_THAT(only_bad(diagnose_lamps(gpio_rig(), machine)).subject, HasSubstr("line 2"));
}

RigDescription usb_rig(const std::string& serial = "") {
    RigDescription rig = gpio_rig();
    rig.lamps_driver = "usb";
    rig.usb.serial = serial;
    return rig;
}

TEST(Doctor, SaysWhatToDoAboutALampController) {
    MachineSeen machine = good_machine();
    EXPECT_THAT(only_bad(diagnose_lamps(usb_rig(), machine)).remedy, HasSubstr("plug it in"));
    machine.boards = {{.node = "/dev/bus/usb/001/004", .serial = "DBX1"}};
    EXPECT_EQ(diagnose_lamps(usb_rig(), machine).at(0).verdict, Verdict::good);
    EXPECT_EQ(diagnose_lamps(usb_rig("DBX1"), machine).at(0).verdict, Verdict::good);
    EXPECT_THAT(only_bad(diagnose_lamps(usb_rig("DBX2"), machine)).found, HasSubstr("another is plugged in: DBX1"));
    machine.boards[0].access = Access::denied;
    EXPECT_THAT(only_bad(diagnose_lamps(usb_rig(), machine)).remedy, HasSubstr("70-darkbox-lamps.rules"));
    machine.lamp_rules = true;
    const Diagnosis denied = only_bad(diagnose_lamps(usb_rig(), machine));
    EXPECT_THAT(denied.found, HasSubstr("eva may not open /dev/bus/usb/001/004"));
    EXPECT_THAT(denied.remedy, HasSubstr("usermod -aG darkbox eva"));
    machine.boards.push_back({.node = "/dev/bus/usb/001/005", .serial = "DBX2"});
    EXPECT_THAT(only_bad(diagnose_lamps(usb_rig(), machine)).found, HasSubstr("2 are plugged in"));
}

TEST(Doctor, ComparesTheCameraWithItsBus) {
    RigDescription rig = gpio_rig();
    MachineSeen machine = good_machine();
    machine.camera_bus_mbit = 480;
    EXPECT_TRUE(diagnose_camera_bus(rig, machine).empty());  // its mode is not told
    rig.camera.width = 1920;
    rig.camera.height = 1080;
    rig.camera.frame_rate = 30;  // 124 MB/s
    const Diagnosis slow = diagnose_camera_bus(rig, machine).at(0);
    EXPECT_EQ(slow.verdict, Verdict::warning);
    EXPECT_THAT(slow.found, HasSubstr("124 MB/s at 480 Mbit/s, which carry about 39"));
    EXPECT_THAT(slow.remedy, HasSubstr("USB 3"));
    machine.camera_bus_mbit = 5000;
    EXPECT_EQ(diagnose_camera_bus(rig, machine).at(0).verdict, Verdict::good);
    machine.camera_bus_mbit.reset();
    EXPECT_TRUE(diagnose_camera_bus(rig, machine).empty());
}

/// A tree as sysfs': a camera and a lamp controller on USB.
class DoctorOnUsb : public testing::Test {
protected:
    DoctorOnUsb() {
        write("dev/video0", "");
        device("1-2", {{"idVendor", "046d"}, {"idProduct", "0825"}, {"speed", "480"}, {"product", "Webcam"}});
        device("1-3", {{"idVendor", "1209"}, {"idProduct", "0001"}, {"product", "darkbox lamp controller"}});
        fs::create_directories(sys() / "devices/usb1/1-2/1-2:1.0/video4linux/video0");
        fs::create_directories(sys() / "class/video4linux");
        fs::create_directory_symlink("../../devices/usb1/1-2/1-2:1.0/video4linux/video0",
                                     sys() / "class/video4linux/video0");
        fs::create_directory_symlink("../..", sys() / "devices/usb1/1-2/1-2:1.0/video4linux/video0/device");
        rig_ = gpio_rig();
        rig_.lamps_driver = "usb";
        rig_.camera.device = (folder_.path() / "dev/video0").string();
    }
    fs::path sys() const { return folder_.path() / "sys"; }
    void write(const fs::path& file, const std::string& text) const {
        fs::create_directories((folder_.path() / file).parent_path());
        std::ofstream(folder_.path() / file) << text << "\n";
    }
    void device(const std::string& place, const std::vector<std::pair<std::string, std::string>>& files) const {
        for (const auto& [name, text] : files) write("sys/devices/usb1/" + place + "/" + name, text);
        fs::create_directories(sys() / "bus/usb/devices");
        fs::create_directory_symlink("../../../devices/usb1/" + place, sys() / "bus/usb/devices" / place);
    }
    void power(const std::string& place, const std::string& control, const std::string& delay) const {
        write("sys/devices/usb1/" + place + "/power/control", control);
        write("sys/devices/usb1/" + place + "/power/autosuspend_delay_ms", delay);
    }
    Diagnoses looked(bool udev_rules = false) const {
        MachineSeen machine = good_machine();
        machine.udev_rules = udev_rules;
        look_at_usb(rig_, machine, sys());
        return diagnose_usb_power(machine);
    }

    const test::TemporaryFolder folder_;
    RigDescription rig_;
};

TEST_F(DoctorOnUsb, SaysHowToKeepItsDevicesAwake) {
    power("1-2", "auto", "2000");
    power("1-3", "on", "2000");
    const Diagnoses found = looked();
    ASSERT_EQ(found.size(), 2U);
    EXPECT_EQ(found[0].subject, "lamp controller's power");
    EXPECT_EQ(found[0].verdict, Verdict::good);
    EXPECT_EQ(found[1].subject, "camera's power");
    EXPECT_EQ(found[1].verdict, Verdict::warning);
    EXPECT_THAT(found[1].found, HasSubstr("autosuspend"));
    EXPECT_THAT(found[1].remedy, HasSubstr("echo on | sudo tee " + fs::canonical(sys() / "devices/usb1/1-2").string() +
                                           "/power/control"));
    EXPECT_THAT(found[1].remedy, HasSubstr("install darkbox-daemon"));
    EXPECT_THAT(looked(true)[1].remedy, HasSubstr("udevadm trigger"));
    power("1-3", "auto", "0");
    EXPECT_EQ(looked()[0].verdict, Verdict::warning);
}

TEST_F(DoctorOnUsb, IsContentWithWhatStaysAwake) {
    power("1-2", "on", "2000");
    power("1-3", "auto", "-1000");  // never
    for (const Diagnosis& d : looked()) EXPECT_EQ(d.verdict, Verdict::good) << d.subject;
    rig_.lamps_driver = "gpio";
    rig_.camera.device = (folder_.path() / "dev/none").string();
    EXPECT_TRUE(looked().empty());
}

TEST_F(DoctorOnUsb, KnowsTheCamerasBus) {
    MachineSeen machine = good_machine();
    look_at_usb(rig_, machine, sys());
    EXPECT_EQ(machine.camera_bus_mbit, 480);
    ASSERT_EQ(machine.boards.size(), 1U);
}

TEST(Doctor, MeasuresTheDisk) {
    const test::TemporaryFolder folder;
    const Diagnoses good = diagnose_disk(gpio_rig(), folder.path() / "sessions");
    EXPECT_EQ(good.front().verdict, Verdict::good);
    EXPECT_THAT(good.front().found, HasSubstr("MB/s"));
    EXPECT_TRUE(fs::is_empty(folder.path() / "sessions"));
    RigDescription fast = gpio_rig();
    fast.camera.width = fast.camera.height = 100'000;
    fast.camera.frame_rate = 1000;
    const Diagnoses slow = diagnose_disk(fast, folder.path() / "sessions");
    EXPECT_EQ(slow.at(1).verdict, Verdict::warning);
    std::ofstream(folder.path() / "file") << "";
    EXPECT_EQ(diagnose_disk(gpio_rig(), folder.path() / "file").front().verdict, Verdict::bad);
}

}  // namespace
}  // namespace darkbox
