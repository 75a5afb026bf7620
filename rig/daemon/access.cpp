#include "rig/daemon/access.h"

#include <fmt/format.h>
#include <grp.h>
#include <openssl/crypto.h>
#include <pwd.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>

#include "acquisition/device/device_error.h"
#include "acquisition/session/durable_file.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t shortest_token = 32;
constexpr std::size_t longest_token = 256;

bool equal_in_constant_time(const std::string& a, std::string_view b) {
    return a.size() == b.size() && CRYPTO_memcmp(a.data(), b.data(), a.size()) == 0;
}

std::string lower(std::string text) {
    std::ranges::transform(text, text.begin(),
                           [](unsigned char c) { return static_cast<char>(c >= 'A' && c <= 'Z' ? c + 32 : c); });
    return text;
}

/// "*.lab.example:7640" stands for one more part before the first dot, never for several.
bool covers(const std::string& own, const std::string& host) {
    if (!own.starts_with("*.")) return own == host;
    const auto dot = host.find('.');
    return dot != host.npos && dot > 0 && std::string_view(host).substr(dot) == std::string_view(own).substr(1);
}

bool is_own(const TcpAccess& access, const std::string& host) {
    return std::ranges::any_of(access.hosts, [host = lower(host)](const auto& own) { return covers(own, host); });
}

/// As a header, or among the WebSocket's protocols.
bool has_token(const TcpAccess& access, const Credentials& given) {
    constexpr std::string_view scheme = "bearer ";
    if (lower(given.authorization.substr(0, scheme.size())) == scheme)
        return equal_in_constant_time(access.token, std::string_view(given.authorization).substr(scheme.size()));
    std::string_view rest = given.protocols;
    while (!rest.empty()) {
        const auto comma = rest.find(',');
        std::string_view offered = rest.substr(0, comma);
        while (offered.starts_with(' ')) offered.remove_prefix(1);
        constexpr std::string_view mark = "darkbox.token.";
        if (offered.starts_with(mark) && equal_in_constant_time(access.token, offered.substr(mark.size()))) return true;
        rest = comma == rest.npos ? std::string_view() : rest.substr(comma + 1);
    }
    return false;
}

std::string fresh_token() {
    std::array<unsigned char, 32> random{};
    if (::getrandom(random.data(), random.size(), 0) != static_cast<ssize_t>(random.size()))
        throw_errno("getrandom", "for a token", errno);
    std::string token;
    for (const unsigned char byte : random) token += fmt::format("{:02x}", byte);
    return token;
}

bool is_member(uid_t user, gid_t group) {
    constexpr std::size_t room = 16384;
    std::array<char, room> buffer{};
    passwd entry{};
    passwd* found = nullptr;
    if (::getpwuid_r(user, &entry, buffer.data(), buffer.size(), &found) != 0 || found == nullptr) return false;
    std::array<gid_t, 256> groups{};
    int count = static_cast<int>(groups.size());
    ::getgrouplist(found->pw_name, found->pw_gid, groups.data(), &count);
    const auto end = groups.begin() + std::clamp(count, 0, static_cast<int>(groups.size()));
    return std::find(groups.begin(), end, group) != end;
}

}  // namespace

std::vector<std::string> own_hosts(const std::string& address, unsigned short port,
                                   const std::vector<std::string>& names) {
    std::vector<std::string> own{address, "localhost"};
    own.insert(own.end(), names.begin(), names.end());
    for (std::string& host : own) {
        if (host.find(':') != host.npos) host = fmt::format("[{}]", host);
    }
    constexpr unsigned short port_of_https = 443;  // which browsers leave out
    const std::size_t count = own.size();
    for (std::size_t i = 0; i < count; ++i) {
        if (port == port_of_https) own.push_back(own[i]);
        own[i] += fmt::format(":{}", port);
    }
    return own;
}

std::optional<ApiResponse> refuse(const TcpAccess& access, const Credentials& given) {
    if (!is_own(access, given.host))
        return problem(421, "the request is for another host", "use the address that darkboxd listens on");
    const std::string_view scheme = access.tls ? "https://" : "http://";
    if (!given.origin.empty() &&
        (!given.origin.starts_with(scheme) || !is_own(access, given.origin.substr(scheme.size()))))
        return problem(403, "the request comes from a page of another site", "use darkbox's own page");
    if (has_token(access, given)) return std::nullopt;
    ApiResponse refused = problem(401, "the request has no valid token",
                                  "send Authorization: Bearer TOKEN; the token is in the file that darkboxd names");
    refused.headers.emplace_back("WWW-Authenticate", "Bearer");
    return refused;
}

bool may_connect(const PeerAccess& access, uid_t user, gid_t group) {
    if (user == ::geteuid() || user == 0) return true;
    return access.group && (group == *access.group || is_member(user, *access.group));
}

bool RateLimit::take(Clock::time_point now) {
    if (last_ != Clock::time_point())
        left_ = std::min(at_once_, left_ + per_second_ * std::chrono::duration<double>(now - last_).count());
    last_ = now;
    if (left_ < 1) return false;
    left_ -= 1;
    return true;
}

std::string token_in(const fs::path& file) {
    struct stat there{};
    if (::lstat(file.c_str(), &there) != 0) {
        if (errno != ENOENT) throw_errno("lstat", file.string(), errno);
        const mode_t before = ::umask(0077);
        const std::string token = fresh_token();
        try {
            write_durably(file, bytes_of(token + "\n"));
        } catch (...) {
            ::umask(before);
            throw;
        }
        ::umask(before);
        ::chmod(file.c_str(), S_IRUSR | S_IWUSR);
        return token;
    }
    if (!S_ISREG(there.st_mode) || (there.st_mode & S_IRWXO) != 0)
        throw InputError(fmt::format("the token's file {} may be read by others", file.string()),
                         fmt::format("chmod 600 {}, or remove it: a new one is made", file.string()));
    std::string token = read_text(file, longest_token);
    while (token.ends_with('\n') || token.ends_with(' ')) token.pop_back();
    const auto plain = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0; };
    if (token.size() < shortest_token || !std::ranges::all_of(token, plain))
        throw InputError(fmt::format("{} holds no token", file.string()),
                         "it must be 32 or more letters and digits; remove the file and a new one is made");
    return token;
}

}  // namespace darkbox
