#include <zlib.h>

#include <algorithm>
#include <array>

#include "processing/formats/icc_profile.h"
#include "processing/formats/picture_header.h"

namespace darkbox {
namespace {

constexpr std::size_t signature_size = 8;
constexpr std::size_t chunk_overhead = 12;  // length, type, checksum
constexpr std::size_t profile_limit = 1 << 20;

struct Chunk {
    std::string_view type;
    Bytes data;
};

Chunk chunk_at(const ByteReader& png, std::size_t offset) {
    const std::uint32_t length = png.u32(offset);
    const Chunk chunk{png.text(offset + 4, 4), png.part(offset + 8, length)};
    const Bytes checked = png.part(offset + 4, std::size_t{4} + length);
    const auto sum = ::crc32(0, reinterpret_cast<const Bytef*>(checked.data()), static_cast<uInt>(checked.size()));
    if (sum != png.u32(offset + 8 + length)) throw bad_picture(png.file(), "is damaged: a checksum does not fit");
    return chunk;
}

/// iCCP: a name, a zero, the method, then the deflated profile.
std::optional<EmbeddedCurve> curve_of_iccp(Bytes data) {
    const auto end_of_name = std::find(data.begin(), data.end(), std::byte{0});
    const auto start = static_cast<std::size_t>(end_of_name - data.begin()) + 2;
    if (start >= data.size()) return std::nullopt;
    std::vector<std::byte> profile(profile_limit);
    uLongf size = profile.size();
    const Bytes packed = data.subspan(start);
    if (::uncompress(reinterpret_cast<Bytef*>(profile.data()), &size, reinterpret_cast<const Bytef*>(packed.data()),
                     packed.size()) != Z_OK)
        return std::nullopt;
    return curve_of_icc_profile(Bytes(profile).first(size));
}

/// A profile outranks sRGB, which outranks gAMA (PNG specification, 4.2.2).
std::optional<EmbeddedCurve> curve_of_gamma(const ByteReader& gamma) {
    constexpr std::uint32_t one = 100000;
    return gamma.u32(0) == one ? EmbeddedCurve::linear : EmbeddedCurve::srgb;
}

}  // namespace

PictureHeader inspect_png(Bytes bytes, const std::string& file) {
    const ByteReader png(bytes, ByteReader::Order::big, file);
    PictureHeader header;
    std::optional<EmbeddedCurve> profile, srgb, gamma;
    for (std::size_t offset = signature_size;;) {
        const Chunk chunk = chunk_at(png, offset);
        const ByteReader data(chunk.data, ByteReader::Order::big, file);
        if (chunk.type == "IHDR") {
            header.width = data.u32(0);
            header.height = data.u32(4);
            header.bit_depth = data.u8(8) == 16 ? 16 : 8;
        }
        if (chunk.type == "iCCP") profile = curve_of_iccp(chunk.data);
        if (chunk.type == "sRGB") srgb = EmbeddedCurve::srgb;
        if (chunk.type == "gAMA") gamma = curve_of_gamma(data);
        if (chunk.type == "IEND") break;
        offset += chunk_overhead + chunk.data.size();
    }
    header.embedded = profile ? profile : srgb ? srgb : gamma;
    return header;
}

}  // namespace darkbox
