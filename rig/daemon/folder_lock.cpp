#include "rig/daemon/folder_lock.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>

#include <cerrno>

#include "acquisition/device/device_error.h"
#include "acquisition/session/durable_file.h"

namespace darkbox {

FolderLock::FolderLock(const std::filesystem::path& folder) {
    make_folder_durably(folder);
    const std::filesystem::path file = folder / "lock";
    fd_.reset(::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0600));
    if (!fd_) throw_errno("open", file.string(), errno);
    if (::flock(fd_.get(), LOCK_EX | LOCK_NB) == 0) return;
    if (errno != EWOULDBLOCK) throw_errno("flock", file.string(), errno);
    throw InputError(fmt::format("another darkboxd has the sessions' folder {}", folder.parent_path().string()),
                     "use it, stop it, or choose another --sessions");
}

}  // namespace darkbox
