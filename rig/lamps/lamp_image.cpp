#include "rig/lamps/lamp_image.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cstring>
#include <fstream>
#include <optional>
#include <string>

#include "acquisition/frame/error.h"

namespace darkbox {

using lamp_protocol::ImageMark;

namespace {

constexpr std::size_t bootloader = 0x7000;  ///< where the chip's own loader begins
constexpr std::size_t least_line = 5;       ///< count, address, kind, sum
enum : std::uint8_t { kind_data = 0, kind_end = 1, kind_segment = 2, kind_start = 3 };

[[noreturn]] void refuse(const std::filesystem::path& file, const std::string& why) {
    throw InputError(fmt::format("{}: {}", file.string(), why),
                     "name the lamp-controller.hex that was built with this darkbox");
}

/// The bytes of ":10246200464C…"; none when it is no such line, or its sum is wrong.
std::optional<std::vector<std::uint8_t>> read_line(std::string line) {
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (line.size() < 1 + 2 * least_line || line.front() != ':' || line.size() % 2 == 0) return std::nullopt;
    std::vector<std::uint8_t> bytes;
    std::uint8_t sum = 0;
    for (std::size_t i = 1; i < line.size(); i += 2) {
        std::uint8_t byte = 0;
        const char* end = line.data() + i + 2;
        if (std::from_chars(line.data() + i, end, byte, 16).ptr != end) return std::nullopt;
        bytes.push_back(byte);
        sum = static_cast<std::uint8_t>(sum + byte);
    }
    if (sum != 0 || bytes.size() != bytes.front() + least_line) return std::nullopt;
    return bytes;
}

std::optional<ImageMark> find_mark(const std::vector<std::uint8_t>& bytes) {
    constexpr char magic[] = DARKBOX_LAMP_IMAGE_MAGIC;
    const auto found = std::search(bytes.begin(), bytes.end(), std::begin(magic), std::end(magic));
    if (bytes.end() - found < static_cast<std::ptrdiff_t>(sizeof(ImageMark))) return std::nullopt;
    ImageMark mark;
    std::memcpy(&mark, &*found, sizeof mark);
    return mark;
}

}  // namespace

LampImage read_lamp_image(const std::filesystem::path& file) {
    std::ifstream in(file);
    if (!in) refuse(file, "the file cannot be read");
    LampImage image;
    bool ended = false;
    int number = 0;
    for (std::string text; std::getline(in, text) && !ended;) {
        ++number;
        if (text.find_first_not_of(" \r") == std::string::npos) continue;
        const auto line = read_line(text);
        if (!line) refuse(file, fmt::format("line {} is damaged, or the file is no Intel HEX", number));
        const std::uint8_t kind = (*line)[3];
        const std::size_t address = static_cast<std::size_t>((*line)[1]) << 8U | (*line)[2];
        if (kind == kind_end) ended = true;
        if (kind != kind_data) {
            if (kind > kind_start) refuse(file, fmt::format("line {} lies beyond the chip's memory", number));
            continue;
        }
        const std::size_t end = address + line->front();
        if (end > bootloader) refuse(file, fmt::format("line {} lies where the chip's bootloader is", number));
        if (image.bytes.size() < end) image.bytes.resize(end, 0xFF);
        std::copy_n(line->begin() + 4, line->front(), image.bytes.begin() + static_cast<std::ptrdiff_t>(address));
    }
    if (!ended) refuse(file, "the file ends early");
    const auto mark = find_mark(image.bytes);
    if (!mark) refuse(file, "this is no lamp controller's firmware");
    if (mark->protocol_major != lamp_protocol::version_major || mark->protocol_minor < lamp_protocol::version_minor)
        refuse(file, fmt::format("this firmware speaks version {}.{} of the lamp protocol, this darkbox version {}.{}",
                                 mark->protocol_major, mark->protocol_minor, lamp_protocol::version_major,
                                 lamp_protocol::version_minor));
    image.mark = *mark;
    return image;
}

}  // namespace darkbox
