#include "processing/formats/atomic_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>

#include "acquisition/frame/error.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(const char* action, const fs::path& path, int error) {
    throw InputError(fmt::format("cannot {} {}: {}", action, path.string(), std::strerror(error)),
                     error == ENOSPC ? "free some space on that disk, or choose another folder"
                                     : "check the path and its permissions");
}

fs::path folder_of(const fs::path& path) { return path.has_parent_path() ? path.parent_path() : fs::path("."); }

void make_folder(const fs::path& folder) {
    std::error_code error;
    fs::create_directories(folder, error);
    if (error) fail("make the folder", folder, error.value());
}

}  // namespace

/// A descriptor that is closed on every way out.
class AtomicFile::Descriptor {
public:
    Descriptor(const fs::path& path, int flags) : path_(path), fd_(::open(path.c_str(), flags | O_CLOEXEC, 0666)) {
        if (fd_ < 0) fail("open", path_, errno);
    }
    Descriptor(const Descriptor&) = delete;
    Descriptor& operator=(const Descriptor&) = delete;
    ~Descriptor() { ::close(fd_); }

    void write(std::span<const std::byte> bytes) {
        while (!bytes.empty()) {
            const ssize_t written = ::write(fd_, bytes.data(), bytes.size());
            if (written < 0 && errno == EINTR) continue;
            if (written < 0) fail("write", path_, errno);
            bytes = bytes.subspan(static_cast<std::size_t>(written));
        }
    }
    void seek(std::uint64_t position) {
        if (::lseek(fd_, static_cast<off_t>(position), SEEK_SET) < 0) fail("write", path_, errno);
    }
    void flush() {
        if (::fsync(fd_) != 0) fail("flush", path_, errno);
    }

private:
    fs::path path_;
    int fd_;
};

AtomicFile::AtomicFile(fs::path path) : path_(std::move(path)) {
    const fs::path folder = folder_of(path_);
    make_folder(folder);
    part_ = folder / fmt::format(".{}.part-{}", path_.filename().string(), ::getpid());
    file_ = std::make_unique<Descriptor>(part_, O_WRONLY | O_CREAT | O_TRUNC);
}

AtomicFile::~AtomicFile() {
    if (file_) ::unlink(part_.c_str());
}

void AtomicFile::write(std::span<const std::byte> bytes) { file_->write(bytes); }
void AtomicFile::write(std::string_view text) { write(std::as_bytes(std::span(text))); }
void AtomicFile::seek(std::uint64_t position) { file_->seek(position); }

void AtomicFile::commit() {
    file_->flush();
    if (::rename(part_.c_str(), path_.c_str()) != 0) fail("put in place", path_, errno);
    file_.reset();
    Descriptor(folder_of(path_), O_RDONLY | O_DIRECTORY).flush();
}

void write_file(const fs::path& path, std::span<const std::byte> bytes) {
    AtomicFile file(path);
    file.write(bytes);
    file.commit();
}

void write_file(const fs::path& path, std::string_view text) { write_file(path, std::as_bytes(std::span(text))); }

std::vector<std::byte> read_file(const fs::path& path) {
    std::error_code error;
    const fs::file_status status = fs::status(path, error);
    if (status.type() == fs::file_type::not_found)
        throw InputError(fmt::format("{} does not exist", path.string()), "check the path");
    if (!fs::is_regular_file(status))
        throw InputError(fmt::format("{} is not a file", path.string()), "give the path of a file");
    std::ifstream in(path, std::ios::binary);
    std::vector<std::byte> bytes(fs::file_size(path, error));
    in.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    if (!in || error) throw InputError(fmt::format("cannot read {}", path.string()), "check its permissions");
    return bytes;
}

std::string read_text(const fs::path& path) {
    const std::vector<std::byte> bytes = read_file(path);
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

}  // namespace darkbox
