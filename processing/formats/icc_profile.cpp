#include "processing/formats/icc_profile.h"

namespace darkbox {
namespace {

constexpr std::size_t header_size = 128;
constexpr std::size_t tag_entry_size = 12;

/// 'curv': no entries = identity; one = a gamma as u8Fixed8; more = a table. 'para': function 0 is x^g, g s15Fixed16.
EmbeddedCurve curve_at(const ByteReader& profile, std::size_t offset) {
    const std::string_view type = profile.text(offset, 4);
    if (type == "curv") {
        const std::uint32_t entries = profile.u32(offset + 8);
        const bool identity = entries == 0 || (entries == 1 && profile.u16(offset + 12) == 0x0100);
        return identity ? EmbeddedCurve::linear : EmbeddedCurve::srgb;
    }
    const bool identity = type == "para" && profile.u16(offset + 8) == 0 && profile.u32(offset + 12) == 0x00010000;
    return identity ? EmbeddedCurve::linear : EmbeddedCurve::srgb;
}

}  // namespace

std::optional<EmbeddedCurve> curve_of_icc_profile(Bytes bytes) try {
    const ByteReader profile(bytes, ByteReader::Order::big, "profile");
    const std::uint32_t tags = profile.u32(header_size);
    for (std::uint32_t i = 0; i < tags; ++i) {
        const std::size_t entry = header_size + 4 + i * tag_entry_size;
        const std::string_view tag = profile.text(entry, 4);
        if (tag == "rTRC" || tag == "kTRC") return curve_at(profile, profile.u32(entry + 4));
    }
    return std::nullopt;
} catch (const InputError&) {
    return std::nullopt;
}

}  // namespace darkbox
