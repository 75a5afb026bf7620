#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

namespace darkbox {

/// SHA-256 (FIPS 180-4) as 64 lower-case hexadecimal digits.
std::string sha256_hex(std::span<const std::byte> bytes);

/// Of a file's bytes, read piece by piece. Throws DeviceError when it cannot be read.
std::string sha256_of_file(const std::filesystem::path& file);

}  // namespace darkbox
