#include "processing/formats/row_store.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <string>

#include "acquisition/frame/error.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail_in(const fs::path& folder, const char* action, int error) {
    throw InputError(
        fmt::format("cannot {} a temporary file in {}: {}", action, folder.string(), std::strerror(error)),
        error == ENOSPC || error == EDQUOT ? "free some space on that disk" : "check the folder and its permissions");
}

int open_nameless(const fs::path& folder, std::size_t bytes) {
    std::error_code error;
    fs::create_directories(folder, error);
    std::string name = (folder / ".rows-XXXXXX").string();
    const int fd = ::mkostemp(name.data(), O_CLOEXEC);
    if (fd < 0) fail_in(folder, "make", errno);
    ::unlink(name.c_str());
    if (const int problem = bytes > 0 ? ::posix_fallocate(fd, 0, static_cast<off_t>(bytes)) : 0; problem != 0) {
        ::close(fd);
        fail_in(folder, "make room for", problem);
    }
    return fd;
}

}  // namespace

RowStore::RowStore(const fs::path& folder, std::size_t rows, std::size_t bytes_per_row)
    : folder_(folder), bytes_per_row_(bytes_per_row), fd_(open_nameless(folder, rows * bytes_per_row)) {}

RowStore::~RowStore() { ::close(fd_); }

void RowStore::write(std::size_t row, std::span<const std::byte> bytes) {
    for (auto at = static_cast<off_t>(row * bytes_per_row_); !bytes.empty();) {
        const ssize_t written = ::pwrite(fd_, bytes.data(), bytes.size(), at);
        if (written < 0 && errno == EINTR) continue;
        if (written < 0) fail_in(folder_, "write", errno);
        bytes = bytes.subspan(static_cast<std::size_t>(written));
        at += written;
    }
}

void RowStore::read(std::size_t row, std::span<std::byte> bytes) const {
    for (auto at = static_cast<off_t>(row * bytes_per_row_); !bytes.empty();) {
        const ssize_t got = ::pread(fd_, bytes.data(), bytes.size(), at);
        if (got < 0 && errno == EINTR) continue;
        if (got <= 0) fail_in(folder_, "read", got < 0 ? errno : EIO);
        bytes = bytes.subspan(static_cast<std::size_t>(got));
        at += got;
    }
}

}  // namespace darkbox
