// Loaded before a program (LD_PRELOAD), it lets a disk fail: from the Nth call on that writes to a regular file or
// renames one, so many calls fail with an errno of choice. FAIL_AFTER=N, FAIL_CALLS=COUNT (default: all), FAIL_ERRNO.
#include <dlfcn.h>
#include <sys/stat.h>
#include <sys/types.h>
#include <sys/uio.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <climits>
#include <cstdio>
#include <cstdlib>

namespace {

long setting(const char* name, long otherwise) {
    const char* value = std::getenv(name);
    return value == nullptr ? otherwise : std::strtol(value, nullptr, 10);
}

/// Whether this call is one that fails; errno is set then.
bool fails() {
    static const long after = setting("FAIL_AFTER", LONG_MAX);
    static const long calls = setting("FAIL_CALLS", LONG_MAX);
    static const int error = static_cast<int>(setting("FAIL_ERRNO", ENOSPC));
    static std::atomic<long> seen = 0;
    const long call = seen++;
    if (call < after || call - after >= calls) return false;
    errno = error;
    return true;
}

bool is_file(int fd) {
    struct stat status{};
    return ::fstat(fd, &status) == 0 && S_ISREG(status.st_mode);
}

template <typename Function>
Function* next(const char* name, Function*) {
    return reinterpret_cast<Function*>(::dlsym(RTLD_NEXT, name));
}

}  // namespace

extern "C" {

ssize_t write(int fd, const void* bytes, size_t count) {
    static auto* const real = next("write", &::write);
    return is_file(fd) && fails() ? -1 : real(fd, bytes, count);
}

ssize_t writev(int fd, const iovec* parts, int count) {
    static auto* const real = next("writev", &::writev);
    return is_file(fd) && fails() ? -1 : real(fd, parts, count);
}

ssize_t pwrite64(int fd, const void* bytes, size_t count, off64_t offset) {
    static auto* const real = next("pwrite64", &::pwrite64);
    return is_file(fd) && fails() ? -1 : real(fd, bytes, count, offset);
}

int fsync(int fd) {
    static auto* const real = next("fsync", &::fsync);
    return is_file(fd) && fails() ? -1 : real(fd);
}

int fdatasync(int fd) {
    static auto* const real = next("fdatasync", &::fdatasync);
    return is_file(fd) && fails() ? -1 : real(fd);
}

int ftruncate64(int fd, off64_t length) noexcept {
    static auto* const real = next("ftruncate64", &::ftruncate64);
    return is_file(fd) && fails() ? -1 : real(fd, length);
}

int rename(const char* from, const char* to) noexcept {
    static auto* const real = next("rename", &::rename);
    return fails() ? -1 : real(from, to);
}

}  // extern "C"
