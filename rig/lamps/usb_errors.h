#pragma once

#include <string>

namespace darkbox {

/// Turns a code of libusb into a DeviceError that says what was tried and what to do; a timeout into a DeadlineError.
[[noreturn]] void throw_usb(const std::string& what, int libusb_error);

}  // namespace darkbox
