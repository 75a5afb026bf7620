#include "rig/lamps/usb_errors.h"

#include <fmt/format.h>
#include <libusb.h>

#include "acquisition/device/device_error.h"

namespace darkbox {

void throw_usb(const std::string& what, int error) {
    const std::string words = fmt::format("{}: {}", what, libusb_strerror(error));
    switch (error) {
        case LIBUSB_ERROR_TIMEOUT:
            throw DeadlineError(words, "unplug the lamp controller and plug it in again");
        case LIBUSB_ERROR_ACCESS:
            throw DeviceError(words, "install rig/system/70-darkbox-lamps.rules, and join the group darkbox");
        case LIBUSB_ERROR_BUSY:
            throw DeviceError(words, "another program holds the lamp controller; stop it first");
        case LIBUSB_ERROR_NO_DEVICE:
            throw DeviceError(words, "the lamp controller is gone: check its cable and its supply");
        default:
            throw DeviceError(words, "unplug the lamp controller and plug it in again");
    }
}

}  // namespace darkbox
