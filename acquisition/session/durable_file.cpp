#include "acquisition/session/durable_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>

#include "acquisition/device/device_error.h"
#include "acquisition/device/unique_fd.h"
#include "acquisition/session/disk_fault.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t largest_copy = std::size_t{4} << 30;

fs::path parent_of(const fs::path& path) { return path.has_parent_path() ? path.parent_path() : fs::path("."); }

void write_whole(int fd, std::span<const std::byte> bytes, const fs::path& path) {
    while (!bytes.empty()) {
        const ssize_t count = ::write(fd, bytes.data(), bytes.size());
        if (count < 0 && errno == EINTR) continue;
        if (count < 0) throw_errno("write", path.string(), errno);
        bytes = bytes.subspan(static_cast<std::size_t>(count));
    }
}

void write_and_flush(const fs::path& file, std::span<const std::byte> bytes) {
    const UniqueFd fd(::open(file.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NOFOLLOW, 0644));
    if (!fd) throw_errno("open", file.string(), errno);
    write_all(fd.get(), bytes, file);
    if (::fsync(fd.get()) != 0) throw_errno("fsync", file.string(), errno);
}

}  // namespace

std::span<const std::byte> bytes_of(std::string_view text) { return std::as_bytes(std::span(text)); }

void write_durably(const fs::path& file, std::span<const std::byte> bytes) {
    const fs::path partial = parent_of(file) / partial_name;
    try {
        write_and_flush(partial, bytes);
        if (::rename(partial.c_str(), file.c_str()) != 0) throw_errno("rename", file.string(), errno);
    } catch (...) {
        ::unlink(partial.c_str());
        throw;
    }
    flush_folder(parent_of(file));
}

void make_folder_durably(const fs::path& folder) {
    std::error_code ignored;
    if (fs::is_directory(folder, ignored)) return;
    if (folder.has_parent_path()) make_folder_durably(folder.parent_path());
    if (::mkdir(folder.c_str(), 0755) != 0 && !(errno == EEXIST && fs::is_directory(folder, ignored)))
        throw_errno("mkdir", folder.string(), errno);
    flush_folder(parent_of(folder));
}

void write_all(int fd, std::span<const std::byte> bytes, const fs::path& path) {
    if (const int error = disk_fault_of(path); error != 0) {
        if (error == ENOSPC) write_whole(fd, bytes.first(bytes.size() / 2), path);
        throw_errno("write", path.string(), error);
    }
    write_whole(fd, bytes, path);
}

void link_or_copy_durably(const fs::path& file, const fs::path& target) {
    if (::link(file.c_str(), target.c_str()) == 0) return flush_folder(parent_of(target));
    if (errno == EEXIST) throw_errno("link", target.string(), errno);
    write_durably(target, bytes_of(read_text(file, largest_copy)));
}

void flush_folder(const fs::path& folder) {
    const UniqueFd fd(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    if (!fd) throw_errno("open", folder.string(), errno);
    if (::fsync(fd.get()) != 0) throw_errno("fsync", folder.string(), errno);
}

std::string read_text(const fs::path& file, std::size_t limit) {
    const UniqueFd fd(::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW));
    if (!fd) throw_errno("open", file.string(), errno);
    std::string text;
    constexpr std::size_t piece_bytes = 64 * 1024;
    while (true) {
        const std::size_t end = text.size();
        text.resize(end + piece_bytes);
        const ssize_t count = ::read(fd.get(), text.data() + end, piece_bytes);
        text.resize(end + (count > 0 ? static_cast<std::size_t>(count) : 0));
        if (count == 0) return text;
        if (count < 0 && errno != EINTR) throw_errno("read", file.string(), errno);
        if (text.size() > limit)
            throw InputError(fmt::format("{} is larger than {} MiB", file.string(), limit >> 20),
                             "it was not written by darkbox; take the session from a backup");
    }
}

fs::path plain_file_inside(const fs::path& folder, const fs::path& name) {
    const auto refuse = [&](const fs::path& at, const char* what) {
        throw InputError(fmt::format("{} is {}", at.string(), what),
                         "a session holds plain files only; put the file itself there");
    };
    if (name.is_absolute()) refuse(name, "outside the session");
    fs::path at = folder;
    for (auto part = name.begin(); part != name.end(); ++part) {
        at /= *part;
        if (*part == "..") refuse(at, "outside the session");
        std::error_code ignored;
        const fs::file_status status = fs::symlink_status(at, ignored);
        if (!fs::exists(status)) return folder / name;
        if (fs::is_symlink(status)) refuse(at, "a link");
        const bool last = std::next(part) == name.end();
        if (last && !fs::is_regular_file(status)) refuse(at, "not a regular file");
        if (!last && !fs::is_directory(status)) refuse(at, "not a folder");
    }
    return at;
}

}  // namespace darkbox
