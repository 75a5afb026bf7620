#include "acquisition/session/session_lock.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>

#include <cerrno>

#include "acquisition/device/device_error.h"

namespace darkbox {
namespace {

/// A writer that has sealed removes the file: what was locked may be there no more.
bool is_same_file(int fd, const std::filesystem::path& path) {
    struct stat held{};
    struct stat there{};
    return ::fstat(fd, &held) == 0 && ::stat(path.c_str(), &there) == 0 && held.st_ino == there.st_ino &&
           held.st_dev == there.st_dev;
}

}  // namespace

UniqueFd lock_session(const std::filesystem::path& folder) {
    const std::filesystem::path file = folder / lock_name;
    while (true) {
        UniqueFd fd(::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0644));
        if (!fd) throw_errno("open", file.string(), errno);
        if (::flock(fd.get(), LOCK_EX | LOCK_NB) != 0) {
            if (errno == EINTR) continue;
            if (errno != EWOULDBLOCK) throw_errno("flock", file.string(), errno);
            throw InputError(fmt::format("the session {} is being written by another darkbox", folder.string()),
                             "wait until that one has finished, or stop it");
        }
        if (is_same_file(fd.get(), file)) return fd;
    }
}

}  // namespace darkbox
