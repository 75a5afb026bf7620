#include "rig/daemon/tls.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/ssl.h>
#include <openssl/x509v3.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <system_error>

#include "acquisition/frame/error.h"
#include "rig/daemon/tls_stream.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;
using Time = std::chrono::system_clock::time_point;

template <auto free_it>
struct FreeBy {
    template <typename T>
    void operator()(T* thing) const {
        free_it(thing);
    }
};
using NamesPtr = std::unique_ptr<GENERAL_NAMES, FreeBy<GENERAL_NAMES_free>>;

/// OpenSSL's last complaint, its queue emptied.
std::string last_complaint() {
    const unsigned long code = ERR_peek_last_error();
    ERR_clear_error();
    const char* reason = ERR_reason_error_string(code);
    return reason == nullptr ? "unknown" : reason;
}

void refuse_unreadable(const fs::path& file, const char* what, const char* setting) {
    struct stat there{};
    const bool found = ::stat(file.c_str(), &there) == 0;
    const int why = found && !S_ISREG(there.st_mode) ? EISDIR : errno;
    if (found && S_ISREG(there.st_mode) && ::access(file.c_str(), R_OK) == 0) return;
    throw InputError(
        fmt::format("the {} {} cannot be read: {}", what, file.string(), std::generic_category().message(why)),
        fmt::format("[api] {} must name a PEM file that darkboxd's user may read", setting));
}

void refuse_open_key(const fs::path& key) {
    struct stat there{};
    if (::stat(key.c_str(), &there) == 0 && (there.st_mode & S_IRWXO) == 0) return;
    throw InputError(
        fmt::format("the key {} may be read by others", key.string()),
        fmt::format("chmod 640 {0}; when others may have read it, make a new key and certificate", key.string()));
}

Time time_of(const ASN1_TIME* text) {
    std::tm broken_down{};
    if (text == nullptr || ASN1_TIME_to_tm(text, &broken_down) != 1) return Time::min();
    return std::chrono::system_clock::from_time_t(::timegm(&broken_down));
}

std::string day(Time time) { return fmt::format("{:%Y-%m-%d %H:%M} UTC", fmt::gmtime(time)); }

void refuse_out_of_time(const X509* certificate, const fs::path& file, Time now) {
    const Time begins = time_of(X509_get0_notBefore(certificate));
    const Time ends = time_of(X509_get0_notAfter(certificate));
    if (now < begins)
        throw InputError(fmt::format("the certificate {} is valid only from {} on", file.string(), day(begins)),
                         "see whether this machine's clock is right");
    if (now >= ends)
        throw InputError(fmt::format("the certificate {} has expired, on {}", file.string(), day(ends)),
                         "renew it, then start darkboxd again");
}

std::string address_text(const ASN1_OCTET_STRING* octets) {
    const unsigned char* bytes = ASN1_STRING_get0_data(octets);
    const int length = ASN1_STRING_length(octets);
    if (length == 4) {
        asio::ip::address_v4::bytes_type v4{};
        std::copy_n(bytes, v4.size(), v4.begin());
        return asio::ip::make_address_v4(v4).to_string();
    }
    if (length != 16) return "";
    asio::ip::address_v6::bytes_type v6{};
    std::copy_n(bytes, v6.size(), v6.begin());
    return asio::ip::make_address_v6(v6).to_string();
}

std::string lower_case(std::string text) {
    std::ranges::transform(text, text.begin(),
                           [](unsigned char c) { return static_cast<char>(c >= 'A' && c <= 'Z' ? c + 32 : c); });
    return text;
}

/// The subject's alternative names (RFC 6125): browsers look at no other.
std::vector<std::string> names_of(const X509* certificate) {
    std::vector<std::string> result;
    const NamesPtr names(
        static_cast<GENERAL_NAMES*>(X509_get_ext_d2i(certificate, NID_subject_alt_name, nullptr, nullptr)));
    for (int i = 0; names && i < sk_GENERAL_NAME_num(names.get()); ++i) {
        const GENERAL_NAME* name = sk_GENERAL_NAME_value(names.get(), i);
        std::string text;
        if (name->type == GEN_DNS)
            text = lower_case({reinterpret_cast<const char*>(ASN1_STRING_get0_data(name->d.dNSName)),
                               static_cast<std::size_t>(ASN1_STRING_length(name->d.dNSName))});
        if (name->type == GEN_IPADD) text = address_text(name->d.iPAddress);
        if (!text.empty() && text.find('\0') == text.npos) result.push_back(text);
    }
    return result;
}

/// No passphrase is asked for at a terminal that a daemon does not have.
int no_passphrase(char*, int, int, void* asked) {
    *static_cast<bool*>(asked) = true;
    return 0;
}

void take_key(SSL_CTX* context, const TlsFiles& files) {
    bool encrypted = false;
    SSL_CTX_set_default_passwd_cb(context, no_passphrase);
    SSL_CTX_set_default_passwd_cb_userdata(context, &encrypted);
    const bool taken = SSL_CTX_use_PrivateKey_file(context, files.key.c_str(), SSL_FILETYPE_PEM) == 1;
    SSL_CTX_set_default_passwd_cb_userdata(context, nullptr);
    SSL_CTX_set_default_passwd_cb(context, nullptr);
    if (encrypted)
        throw InputError(
            fmt::format("the key {} is encrypted, and nobody is there to unlock it", files.key.string()),
            fmt::format("write it without a passphrase: openssl pkey -in {} -out NEW_FILE", files.key.string()));
    const int reason = ERR_GET_REASON(ERR_peek_last_error());
    if (!taken && reason == X509_R_KEY_VALUES_MISMATCH) {
        ERR_clear_error();
        throw InputError(fmt::format("the key {} does not belong to the certificate {}", files.key.string(),
                                     files.certificate.string()),
                         "name the key that the certificate was made with");
    }
    if (!taken)
        throw InputError(fmt::format("{} holds no key: {}", files.key.string(), last_complaint()),
                         "it must be a PEM file that begins with -----BEGIN PRIVATE KEY-----");
}

}  // namespace

TlsIdentity load_identity(const TlsFiles& files, Time now) {
    refuse_unreadable(files.certificate, "certificate", "certificate");
    refuse_unreadable(files.key, "key", "key");
    refuse_open_key(files.key);
    ERR_clear_error();
    TlsIdentity identity{
        .context = std::make_shared<asio::ssl::context>(asio::ssl::context::tls_server), .names = {}, .expires = {}};
    SSL_CTX* context = identity.context->native_handle();
    SSL_CTX_set_min_proto_version(context, TLS1_2_VERSION);
    SSL_CTX_set_options(context, SSL_OP_NO_RENEGOTIATION | SSL_OP_NO_COMPRESSION | SSL_OP_CIPHER_SERVER_PREFERENCE);
    // With forward secrecy only; those of TLS 1.3 have it all.
    SSL_CTX_set_cipher_list(context, "ECDHE+AESGCM:ECDHE+CHACHA20");
    if (SSL_CTX_use_certificate_chain_file(context, files.certificate.c_str()) != 1)
        throw InputError(fmt::format("{} holds no certificate: {}", files.certificate.string(), last_complaint()),
                         "it must be a PEM file that begins with -----BEGIN CERTIFICATE-----");
    const X509* certificate = SSL_CTX_get0_certificate(context);
    refuse_out_of_time(certificate, files.certificate, now);
    take_key(context, files);
    identity.names = names_of(certificate);
    identity.expires = time_of(X509_get0_notAfter(certificate));
    if (identity.names.empty())
        throw InputError(fmt::format("the certificate {} is for no host: it has no subject alternative names",
                                     files.certificate.string()),
                         "make one that names this machine: openssl req -x509 ... -addext subjectAltName=DNS:rig.lab");
    return identity;
}

RenewedIdentity::RenewedIdentity(TlsFiles files, Clock::time_point now)
    : files_(std::move(files)), seen_(stamp()), looked_(now), identity_(load_identity(files_, now)) {}

void RenewedIdentity::look(Clock::time_point now) {
    constexpr auto every = std::chrono::seconds(5);
    if (now >= looked_ && now < looked_ + every) return;
    looked_ = now;
    const Stamp there = stamp();
    if (there == seen_) return;
    seen_ = there;
    identity_ = load_identity(files_, now);
}

RenewedIdentity::Stamp RenewedIdentity::stamp() const {
    std::error_code ignored;  // a file that is gone has a time, too: the earliest
    return {fs::last_write_time(files_.certificate, ignored), fs::last_write_time(files_.key, ignored)};
}

}  // namespace darkbox
