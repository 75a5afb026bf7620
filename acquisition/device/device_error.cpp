#include "acquisition/device/device_error.h"

#include <fmt/format.h>

#include <cerrno>
#include <system_error>
#include <utility>

namespace darkbox {
namespace {

std::string hint_for(int error_number) {
    switch (error_number) {
        case ENOSPC:
        case EDQUOT:
            return "free space on that disk; nothing already captured is lost";
        case EACCES:
        case EPERM:
            return "check the permissions of that path and the groups of this user";
        case EROFS:
            return "that file system is read-only; choose another folder";
        case ENOENT:
            return "check the spelling of that path";
        case ENODEV:
        case ENXIO:
            return "the device is gone: check its cable and plug it in again";
        case EBUSY:
            return "another program holds the device; stop it first";
        case EIO:
            return "the device or disk reported a hardware error; see the kernel log";
        default:
            return "see the system's log for details";
    }
}

}  // namespace

DeviceError::~DeviceError() = default;
DeadlineError::~DeadlineError() = default;

void throw_errno(const std::string& call, const std::string& path, int error_number) {
    throw_errno(call, path, error_number, hint_for(error_number));
}

void throw_errno(const std::string& call, const std::string& path, int error_number, std::string hint) {
    throw DeviceError(fmt::format("{} {}: {}", call, path, std::generic_category().message(error_number)),
                      std::move(hint));
}

}  // namespace darkbox
