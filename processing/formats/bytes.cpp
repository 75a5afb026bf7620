#include "processing/formats/bytes.h"

#include <fmt/format.h>

namespace darkbox {

InputError bad_picture(const std::string& file, const std::string& what) {
    return {fmt::format("{} {}", file, what), "copy the picture again from where it was made, or leave it out"};
}

Bytes ByteReader::part(std::size_t offset, std::size_t length) const {
    if (offset > bytes_.size() || length > bytes_.size() - offset) throw bad_picture(file_, "is cut short");
    return bytes_.subspan(offset, length);
}

std::uint64_t ByteReader::number(std::size_t offset, int width) const {
    const Bytes raw = part(offset, static_cast<std::size_t>(width));
    std::uint64_t value = 0;
    for (int i = 0; i < width; ++i) {
        const int place = order_ == Order::big ? i : width - 1 - i;
        value = value << 8 | std::to_integer<std::uint64_t>(raw[static_cast<std::size_t>(place)]);
    }
    return value;
}

std::string_view ByteReader::text(std::size_t offset, std::size_t length) const {
    return {reinterpret_cast<const char*>(part(offset, length).data()), length};
}

}  // namespace darkbox
