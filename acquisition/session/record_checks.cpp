#include "acquisition/session/record_checks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "acquisition/frame/error.h"

namespace darkbox {
namespace {

constexpr std::size_t longest_component = 255;
constexpr std::size_t longest_name = 1024;
constexpr int largest_side = 65'535;
constexpr int deepest_sample = 32;
constexpr int most_shots = 100'000;
constexpr double largest_offset_px = 1e6;  ///< of the principal point, outside the picture

[[noreturn]] void refuse(const std::string& where, std::string_view field, const std::string& value,
                         std::string_view allowed) {
    throw InputError(fmt::format("{}: {} is {}; allowed: {}", where, field, value, allowed),
                     "the session is damaged or was not written by darkbox; take it from a backup");
}

void require_between(const std::string& where, std::string_view field, int value, int least, int most) {
    if (value < least || value > most)
        refuse(where, field, std::to_string(value), fmt::format("{} to {}", least, most));
}

void require_finite(const std::string& where, std::string_view field, double value, double least) {
    if (!std::isfinite(value) || value < least)
        refuse(where, field, fmt::format("{}", value), fmt::format("a number of at least {}", least));
}

void require_length(const std::string& where, std::string_view field, const std::optional<double>& mm) {
    if (mm && !(std::isfinite(*mm) && *mm > 0))
        refuse(where, field, fmt::format("{}", *mm), "a number of more than 0 mm");
}

/// Bytes in the UTF-8 sequence that `first` begins (RFC 3629); 0 when it begins none.
std::size_t sequence_length(unsigned char first) {
    if (first < 0x80) return 1;
    if (first >= 0xC2 && first <= 0xDF) return 2;
    if (first >= 0xE0 && first <= 0xEF) return 3;
    if (first >= 0xF0 && first <= 0xF4) return 4;
    return 0;
}

/// Overlong forms, surrogates and what lies above U+10FFFF show in the second byte.
bool second_byte_allowed(unsigned char first, unsigned char second) {
    switch (first) {
        case 0xE0:
            return second >= 0xA0;
        case 0xED:
            return second <= 0x9F;
        case 0xF0:
            return second >= 0x90;
        case 0xF4:
            return second <= 0x8F;
        default:
            return true;
    }
}

bool is_continuation(char c) { return (static_cast<unsigned char>(c) & 0xC0) == 0x80; }

bool is_good_component(std::string_view part) {
    return !part.empty() && part.size() <= longest_component && part.front() != '.';
}

}  // namespace

bool is_utf8(std::string_view text) {
    while (!text.empty()) {
        const auto first = static_cast<unsigned char>(text.front());
        const std::size_t length = sequence_length(first);
        if (length == 0 || length > text.size()) return false;
        const std::string_view rest = text.substr(1, length - 1);
        if (!std::all_of(rest.begin(), rest.end(), is_continuation)) return false;
        if (length > 1 && !second_byte_allowed(first, static_cast<unsigned char>(rest.front()))) return false;
        text.remove_prefix(length);
    }
    return true;
}

std::string shown(std::string_view text) {
    constexpr std::size_t most = 80;
    std::string result = "\"";
    for (const char c : text.substr(0, most)) {
        const auto byte = static_cast<unsigned char>(c);
        if (byte >= 0x20 && byte < 0x7F)
            result += c;
        else
            result += fmt::format("\\x{:02x}", byte);
    }
    return result + (text.size() > most ? "...\"" : "\"");
}

void require_payload_name(const std::string& where, const std::string& name) {
    bool good = !name.empty() && name.size() <= longest_name && name != "session.json" && is_utf8(name) &&
                name.find('\0') == std::string::npos;
    for (std::size_t begin = 0; good && begin <= name.size();) {
        const std::size_t end = std::min(name.find('/', begin), name.size());
        good = is_good_component(std::string_view(name).substr(begin, end - begin));
        begin = end + 1;
    }
    if (!good)
        throw InputError(fmt::format("{}: {} cannot be the name of a file in a session", where, shown(name)),
                         "use a relative UTF-8 path without empty, hidden or \"..\" parts, not \"session.json\"");
}

void require_sha256(const std::string& where, std::string_view hex) {
    const auto is_hex = [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); };
    if (hex.size() != 64 || !std::all_of(hex.begin(), hex.end(), is_hex))
        refuse(where, "sha256", shown(hex), "64 lower-case hexadecimal digits");
}

void require_valid(const std::string& where, const CaptureGeometry& geometry) {
    require_length(where, "mm_per_pixel", geometry.mm_per_pixel);
    require_length(where, "camera_distance_mm", geometry.camera_distance_mm);
    require_length(where, "ball_diameter_mm", geometry.ball_diameter_mm);
    if (geometry.principal_px)
        for (const double coordinate : *geometry.principal_px)
            require_finite(where, "principal_px", coordinate, -largest_offset_px);
    for (const NominalLamp& lamp : geometry.lamps) {
        double squared = 0;
        for (const double coordinate : lamp.position_mm) squared += coordinate * coordinate;
        if (!(squared > 0 && std::isfinite(squared)))
            refuse(where, fmt::format("position_mm of lamp {}", shown(lamp.name)), fmt::format("{} mm off", squared),
                   "three numbers that are not all 0");
    }
}

void require_valid(const std::string& where, const char* field, const SessionReference& reference) {
    if (!is_good_component(reference.name))
        refuse(where, field, shown(reference.name), "the name of a session's folder");
    require_sha256(where, reference.manifest_sha256);
}

void require_valid(const std::string& where, const SessionInfo& info) {
    require_between(where, "schema_version", info.schema_version, session_schema, session_schema);
    require_between(where, "planned_shots", info.planned_shots, 0, most_shots);
    if (info.geometry) require_valid(where, *info.geometry);
    if (info.retakes) require_valid(where, "retakes", *info.retakes);
    if (info.flats) require_valid(where, "flats", *info.flats);
    require_valid(where, info.record);
}

void require_valid(const std::string& where, const FrameRecord& record) {
    require_payload_name(where, record.file);
    const auto is_token = [](char c) { return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9'); };
    if (record.format.empty() || record.format.size() > 16 ||
        !std::all_of(record.format.begin(), record.format.end(), is_token))
        refuse(where, "format", shown(record.format), "a short name such as \"grey16\" or \"png\"");
    require_between(where, "width", record.width, 1, largest_side);
    require_between(where, "height", record.height, 1, largest_side);
    require_between(where, "bit_depth", record.bit_depth, 1, deepest_sample);
    require_finite(where, "black_level", record.black_level, 0);
    require_finite(where, "exposure_s", record.exposure_s, 0);
    require_finite(where, "gain", record.gain, 0);
    if (record.noise) {
        require_finite(where, "noise floor", record.noise->floor, 0);
        require_finite(where, "noise slope", record.noise->slope, 0);
    }
    if (!record.taken_over_from.empty() && !is_good_component(record.taken_over_from))
        refuse(where, "taken_over_from", shown(record.taken_over_from), "the name of a session's folder");
}

}  // namespace darkbox
