#pragma once

#include <sys/types.h>
#include <chrono>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "rig/daemon/api.h"

namespace darkbox {

/// Who may come in by TCP: whoever has the token, from a program, or from a page that this daemon's own address served.
struct TcpAccess {
    std::string token;
    std::vector<std::string> hosts;  ///< the values of Host (and of Origin, after its scheme) that are this daemon
    bool tls = false;                ///< pages come by https then
};

/// "127.0.0.1:7640" as people write it: the addresses under which a browser may reach it. Besides the address that it
/// listens on, `names` are those of its certificate; "*.lab.example" is any name of one more part.
std::vector<std::string> own_hosts(const std::string& address, unsigned short port,
                                   const std::vector<std::string>& names = {});

/// What a request says of who sends it.
struct Credentials {
    std::string host = {};
    std::string origin = {};         ///< empty where there is none
    std::string authorization = {};  ///< "Bearer TOKEN"
    std::string protocols = {};      ///< Sec-WebSocket-Protocol
};

/// No value for a request that may pass. A page of another site fails by its Origin, one whose name was made to point
/// here (DNS rebinding) by its Host, everybody else by the token.
std::optional<ApiResponse> refuse(const TcpAccess& access, const Credentials& given);

/// Who may come in by the Unix socket: this user, root, and the members of a group.
struct PeerAccess {
    std::optional<gid_t> group = {};
};
/// By the kernel's word (SO_PEERCRED).
bool may_connect(const PeerAccess& access, uid_t user, gid_t group);

/// So many requests a second on the average, so many at once.
class RateLimit {
public:
    using Clock = std::chrono::steady_clock;
    RateLimit(double per_second, double at_once) : per_second_(per_second), at_once_(at_once), left_(at_once) {}
    /// Whether one more is within the limit, now.
    bool take(Clock::time_point now);

private:
    double per_second_, at_once_, left_;
    Clock::time_point last_{};
};

/// The token in the file, made with 256 random bits where there is none; only its owner may read it.
/// Throws InputError for a file that others may read or that holds no token.
std::string token_in(const std::filesystem::path& file);

}  // namespace darkbox
