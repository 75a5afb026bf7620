#include "rig/daemon/open_beneath.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/openat2.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>

#include "acquisition/device/device_error.h"

namespace darkbox {
namespace {

bool means_not_there(int error) {
    constexpr std::array reasons{ENOENT, ENOTDIR, ELOOP, EXDEV, ENAMETOOLONG, EINVAL, EACCES, ENXIO};
    return std::ranges::find(reasons, error) != reasons.end();
}

}  // namespace

std::optional<OpenFile> open_beneath(const std::filesystem::path& root, const std::string& relative) {
    if (relative.empty() || relative.find('\0') != relative.npos) return std::nullopt;
    const UniqueFd folder(::open(root.c_str(), O_PATH | O_DIRECTORY | O_CLOEXEC));
    if (!folder) throw_errno("open", root.string(), errno);
    open_how how{};
    how.flags = O_RDONLY | O_CLOEXEC | O_NONBLOCK;  // a named pipe must not hold anybody up
    how.resolve = RESOLVE_BENEATH | RESOLVE_NO_SYMLINKS | RESOLVE_NO_MAGICLINKS;
    UniqueFd fd(static_cast<int>(::syscall(SYS_openat2, folder.get(), relative.c_str(), &how, sizeof how)));
    if (!fd) {
        if (means_not_there(errno)) return std::nullopt;
        throw_errno("openat2", (root / relative).string(), errno);
    }
    struct stat there{};
    if (::fstat(fd.get(), &there) != 0) throw_errno("fstat", (root / relative).string(), errno);
    if (!S_ISREG(there.st_mode)) return std::nullopt;
    return OpenFile{.fd = std::move(fd),
                    .size = static_cast<std::uint64_t>(there.st_size),
                    .tag = fmt::format("\"{:x}-{:x}-{:x}{:09}\"", there.st_ino, there.st_size, there.st_mtim.tv_sec,
                                       there.st_mtim.tv_nsec),
                    .modified_s = there.st_mtim.tv_sec};
}

}  // namespace darkbox
