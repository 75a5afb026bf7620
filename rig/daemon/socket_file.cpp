#include "rig/daemon/socket_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <thread>

#include "acquisition/device/device_error.h"
#include "acquisition/device/unique_fd.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

constexpr mode_t owner_only = S_IRUSR | S_IWUSR;
constexpr std::size_t longest_path = sizeof(sockaddr_un::sun_path) - 1;

/// Two daemons that start at once must not both take a dead one's place: the folder is locked while one looks.
UniqueFd lock_folder(const fs::path& folder) {
    UniqueFd fd(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    if (!fd) throw_errno("open", folder.string(), errno);
    constexpr int tries = 40;
    for (int i = 0; i < tries; ++i) {
        if (::flock(fd.get(), LOCK_EX | LOCK_NB) == 0) return fd;
        std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
    throw DeviceError(fmt::format("the folder {} stays locked by another program", folder.string()),
                      "stop that program, or choose another --socket");
}

bool answers(asio::io_context& io, const fs::path& path) {
    UnixProtocol::socket probe(io);
    boost::system::error_code error;
    probe.connect(UnixProtocol::endpoint(path.string()), error);
    return !error;
}

void clear_the_way(asio::io_context& io, const fs::path& path) {
    struct stat there{};
    if (::lstat(path.c_str(), &there) != 0) {
        if (errno == ENOENT) return;
        throw_errno("lstat", path.string(), errno);
    }
    if (!S_ISSOCK(there.st_mode))
        throw InputError(fmt::format("{} is not a socket", path.string()), "choose another --socket");
    if (answers(io, path))
        throw InputError(fmt::format("another darkboxd answers at {}", path.string()),
                         "use it, stop it, or choose another --socket");
    if (::unlink(path.c_str()) != 0) throw_errno("unlink", path.string(), errno);
}

void check(const boost::system::error_code& error, const char* call, const fs::path& path) {
    if (error) throw_errno(call, path.string(), error.value());
}

}  // namespace

SocketFile::SocketFile(asio::io_context& io, fs::path path, std::optional<gid_t> group)
    : path_(fs::absolute(path)), acceptor_(io) {
    if (path_.string().size() > longest_path)
        throw InputError(fmt::format("the socket's path {} has {} bytes; allowed: up to {}", path_.string(),
                                     path_.string().size(), longest_path),
                         "choose a shorter --socket");
    std::error_code ignored;  // what is still wrong then, lock_folder() tells
    fs::create_directory(path_.parent_path(), ignored);
    const UniqueFd lock = lock_folder(path_.parent_path());
    clear_the_way(io, path_);
    boost::system::error_code error;
    acceptor_.open(UnixProtocol(), error);
    check(error, "socket", path_);
    // Linux gives the file the mode of the socket it is bound to, so there is no moment in which others may connect.
    if (::fchmod(acceptor_.native_handle(), owner_only) != 0) throw_errno("fchmod", path_.string(), errno);
    acceptor_.bind(UnixProtocol::endpoint(path_.string()), error);
    check(error, "bind", path_);
    if (group) {
        if (::lchown(path_.c_str(), static_cast<uid_t>(-1), *group) != 0) throw_errno("chown", path_.string(), errno);
        if (::chmod(path_.c_str(), owner_only | S_IRGRP | S_IWGRP) != 0) throw_errno("chmod", path_.string(), errno);
    }
    acceptor_.listen(asio::socket_base::max_listen_connections, error);
    check(error, "listen", path_);
    struct stat ours{};
    if (::lstat(path_.c_str(), &ours) != 0) throw_errno("lstat", path_.string(), errno);
    device_ = ours.st_dev;
    inode_ = ours.st_ino;
}

SocketFile::SocketFile(asio::io_context& io, int listening) : acceptor_(io) {
    acceptor_.assign(UnixProtocol(), listening);
    path_ = acceptor_.local_endpoint().path();
}

SocketFile::~SocketFile() {
    if (inode_ == 0) return;
    struct stat there{};
    if (::lstat(path_.c_str(), &there) == 0 && there.st_dev == device_ && there.st_ino == inode_)
        ::unlink(path_.c_str());
}

}  // namespace darkbox
