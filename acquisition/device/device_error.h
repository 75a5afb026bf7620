#pragma once

#include <string>

#include "acquisition/frame/error.h"

namespace darkbox {

/// A device or the operating system failed: which call, on what, and why.
class DeviceError : public Error {
public:
    using Error::Error;
    ~DeviceError() override;
};

/// A deadline passed while waiting for a device.
class DeadlineError : public DeviceError {
public:
    using DeviceError::DeviceError;
    ~DeadlineError() override;
};

/// Turns errno into a DeviceError "CALL PATH: reason" with a hint for the common causes (permissions, full disk, gone).
/// The only place where errno becomes an exception.
[[noreturn]] void throw_errno(const std::string& call, const std::string& path, int error_number);
/// With the hint of who knows the device better than errno does.
[[noreturn]] void throw_errno(const std::string& call, const std::string& path, int error_number, std::string hint);

}  // namespace darkbox
