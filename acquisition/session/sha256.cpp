#include "acquisition/session/sha256.h"

#include <fcntl.h>
#include <openssl/evp.h>

#include <array>
#include <cerrno>
#include <memory>
#include <stdexcept>
#include <vector>

#include "acquisition/device/device_error.h"
#include "acquisition/device/unique_fd.h"

namespace darkbox {
namespace {

constexpr std::size_t piece_bytes = 256 * 1024;

class Sha256 {
public:
    Sha256() : context_(::EVP_MD_CTX_new()) { require(::EVP_DigestInit_ex(context_.get(), ::EVP_sha256(), nullptr)); }

    void update(std::span<const std::byte> bytes) {
        require(::EVP_DigestUpdate(context_.get(), bytes.data(), bytes.size()));
    }

    std::string hex() {
        std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
        unsigned int size = 0;
        require(::EVP_DigestFinal_ex(context_.get(), digest.data(), &size));
        constexpr std::string_view digits = "0123456789abcdef";
        std::string text;
        for (unsigned int i = 0; i < size; ++i) {
            text.push_back(digits[digest[i] >> 4]);
            text.push_back(digits[digest[i] & 0xF]);
        }
        return text;
    }

private:
    struct ContextDeleter {
        void operator()(EVP_MD_CTX* context) const noexcept { ::EVP_MD_CTX_free(context); }
    };

    static void require(int status) {
        if (status != 1) throw std::runtime_error("OpenSSL cannot compute SHA-256");
    }

    std::unique_ptr<EVP_MD_CTX, ContextDeleter> context_;
};

}  // namespace

std::string sha256_hex(std::span<const std::byte> bytes) {
    Sha256 sha;
    sha.update(bytes);
    return sha.hex();
}

std::string sha256_of_file(const std::filesystem::path& file) {
    const UniqueFd fd(::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW));
    if (!fd) throw_errno("open", file.string(), errno);
    Sha256 sha;
    std::vector<std::byte> piece(piece_bytes);
    while (true) {
        const ssize_t count = ::read(fd.get(), piece.data(), piece.size());
        if (count < 0 && errno == EINTR) continue;
        if (count < 0) throw_errno("read", file.string(), errno);
        if (count == 0) return sha.hex();
        sha.update(std::span(piece).first(static_cast<std::size_t>(count)));
    }
}

}  // namespace darkbox
