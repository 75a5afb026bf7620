#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "acquisition/frame/error.h"

namespace darkbox {

using Bytes = std::span<const std::byte>;

/// What every damaged or cut picture throws: one sentence with the file's name and what is wrong with it.
InputError bad_picture(const std::string& file, const std::string& what);

/// Reads numbers at offsets; past the end the file is cut short. Thread-compatible.
class ByteReader {
public:
    enum class Order { big, little };

    ByteReader(Bytes bytes, Order order, std::string file) : bytes_(bytes), order_(order), file_(std::move(file)) {}

    std::uint64_t number(std::size_t offset, int width) const;  ///< width in bytes, 1...8
    std::uint8_t u8(std::size_t offset) const { return static_cast<std::uint8_t>(number(offset, 1)); }
    std::uint16_t u16(std::size_t offset) const { return static_cast<std::uint16_t>(number(offset, 2)); }
    std::uint32_t u32(std::size_t offset) const { return static_cast<std::uint32_t>(number(offset, 4)); }
    std::string_view text(std::size_t offset, std::size_t length) const;
    Bytes part(std::size_t offset, std::size_t length) const;
    std::size_t size() const { return bytes_.size(); }
    const std::string& file() const { return file_; }

private:
    Bytes bytes_;
    Order order_;
    std::string file_;
};

}  // namespace darkbox
