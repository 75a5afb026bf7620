#pragma once

#include <fcntl.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <filesystem>
#include <stdexcept>

#include "acquisition/device/unique_fd.h"

namespace darkbox::test {

inline sockaddr_un unix_address(const std::filesystem::path& path) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path.string().copy(address.sun_path, sizeof address.sun_path - 1);
    return address;
}

/// A Unix socket for packets (SOCK_SEQPACKET) that listens there, as systemd opens one for a unit. Its number is far
/// from those that a child gets.
inline UniqueFd listening_for_packets(const std::filesystem::path& path) {
    constexpr int far = 100;
    const sockaddr_un address = unix_address(path);
    const UniqueFd near(::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0));
    UniqueFd fd(::fcntl(near.get(), F_DUPFD_CLOEXEC, far));
    if (::bind(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
        ::listen(fd.get(), 8) != 0)
        throw std::runtime_error("cannot listen at " + path.string());
    return fd;
}

}  // namespace darkbox::test
