#pragma once

#include <sys/types.h>

#include <filesystem>
#include <optional>

#include "rig/daemon/asio.h"

namespace darkbox {

/// A Unix socket in the file system that listens; only this user, and the group where one is given, may connect (by
/// its mode from the first moment on).
/// The destructor removes the file if it is still its own. Thread-compatible.
class SocketFile {
public:
    /// Replaces what a dead daemon left behind. Throws InputError when a live one answers there, or when something
    /// else than a socket is in the way; DeviceError when the system refuses.
    SocketFile(asio::io_context& io, std::filesystem::path path, std::optional<gid_t> group = std::nullopt);
    /// One that systemd listens on: it is taken as it is, and its file stays.
    SocketFile(asio::io_context& io, int listening);
    SocketFile(const SocketFile&) = delete;
    SocketFile& operator=(const SocketFile&) = delete;
    ~SocketFile();

    UnixProtocol::acceptor& acceptor() { return acceptor_; }
    const std::filesystem::path& path() const { return path_; }

private:
    std::filesystem::path path_;
    UnixProtocol::acceptor acceptor_;
    dev_t device_ = 0;
    ino_t inode_ = 0;
};

}  // namespace darkbox
