#pragma once

#include <chrono>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace boost::asio::ssl {
class context;
}

namespace darkbox {

/// The files by which the daemon shows who it is.
struct TlsFiles {
    std::filesystem::path certificate;  ///< PEM: the daemon's own first, then those that vouch for it
    std::filesystem::path key;          ///< PEM, not encrypted; nobody but the owner and the group may read it
};

/// What a daemon shows to who connects: TLS 1.2 or later, by its certificate.
struct TlsIdentity {
    std::shared_ptr<boost::asio::ssl::context> context;
    std::vector<std::string> names;  ///< those that the certificate is for: host names, "*.lab.example", addresses
    std::chrono::system_clock::time_point expires;
};

/// Throws InputError, with the file and what to do, where one cannot be read or holds no certificate or key, where the
/// key is another's, encrypted or open to others, and for a certificate that is not valid now or names nobody.
TlsIdentity load_identity(const TlsFiles& files, std::chrono::system_clock::time_point now);

/// An identity that follows its files: certificates are renewed every few months, and nobody should have to remember
/// this daemon then. Thread-compatible.
class RenewedIdentity {
public:
    using Clock = std::chrono::system_clock;

    explicit RenewedIdentity(TlsFiles files, Clock::time_point now = Clock::now());

    /// Looks whether the files changed, at most once in a few seconds. Throws as load_identity() where they no longer
    /// do, once for each change; the identity stays what it was then.
    void look(Clock::time_point now);
    const TlsIdentity& get() const { return identity_; }

private:
    struct Stamp {
        std::filesystem::file_time_type certificate{};
        std::filesystem::file_time_type key{};
        bool operator==(const Stamp&) const = default;
    };
    Stamp stamp() const;

    TlsFiles files_;
    Stamp seen_;
    Clock::time_point looked_;
    TlsIdentity identity_;
};

}  // namespace darkbox
