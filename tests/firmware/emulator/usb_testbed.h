#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>

#include "tests/firmware/emulator/paced_board.h"

namespace darkbox::test {

/// Emulated boards as USB devices of this process and its children: umockdev stands in for sysfs, udev and the ioctls
/// of usbfs, so that Debian's libusb talks to them as it does to the kernel. The program must run under
/// umockdev-wrapper.
class UsbTestbed {
public:
    UsbTestbed();
    UsbTestbed(const UsbTestbed&) = delete;
    UsbTestbed& operator=(const UsbTestbed&) = delete;
    ~UsbTestbed();

    /// Whether this process runs under umockdev-wrapper.
    static bool available();

    /// The number of the board here.
    int plug_in(const std::filesystem::path& elf, const std::optional<lamp_protocol::Identity>& identity);
    PacedBoard& board(int number);
    void pull_cable(int number);
    void plug_cable(int number);

private:
    struct Device;
    struct Bed;
    std::unique_ptr<Bed> bed_;
    std::map<int, std::unique_ptr<Device>> devices_;
};

}  // namespace darkbox::test
