#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "firmware/protocol/lamp_protocol.h"

namespace darkbox {

/// A lamp controller's firmware, as an Intel HEX file that says of itself what it is.
struct LampImage {
    std::vector<std::uint8_t> bytes;  ///< from address 0
    lamp_protocol::ImageMark mark;
};

/// Checks every line's sum, that the image leaves the bootloader's place alone, that it carries the lamp controller's
/// mark, and that this darkbox speaks its protocol. Throws InputError.
LampImage read_lamp_image(const std::filesystem::path& hex_file);

}  // namespace darkbox
