#include "processing/formats/icc_profile.h"
#include "processing/formats/picture_header.h"

namespace darkbox {
namespace {

constexpr std::uint8_t marker_prefix = 0xFF;
constexpr std::uint8_t end_of_image = 0xD9;
constexpr std::uint8_t start_of_scan = 0xDA;
constexpr std::uint8_t app2 = 0xE2;
constexpr std::string_view icc_signature("ICC_PROFILE\0", 12);

bool starts_a_frame(std::uint8_t marker) {  // SOF0...15 but for DHT, JPG and DAC
    return marker >= 0xC0 && marker <= 0xCF && marker != 0xC4 && marker != 0xC8 && marker != 0xCC;
}
bool stands_alone(std::uint8_t marker) { return marker == 0x01 || (marker >= 0xD0 && marker <= 0xD8); }

/// The next marker that is not part of a scan's entropy-coded data, at or after `offset`.
std::size_t end_of_scan(const ByteReader& jpeg, std::size_t offset) {
    for (;; ++offset) {
        if (jpeg.u8(offset) != marker_prefix) continue;
        const std::uint8_t next = jpeg.u8(offset + 1);
        const bool restart = next >= 0xD0 && next <= 0xD7;
        if (next != 0 && next != marker_prefix && !restart) return offset;
    }
}

void read_segment(const ByteReader& segment, std::uint8_t marker, PictureHeader& header) {
    if (starts_a_frame(marker)) {
        header.height = segment.u16(1);
        header.width = segment.u16(3);
    }
    const bool icc = marker == app2 && segment.size() > icc_signature.size() + 2 &&
                     segment.text(0, icc_signature.size()) == icc_signature;
    if (icc && segment.u8(icc_signature.size()) == 1) {  // the first part of a profile holds its tags
        const std::size_t start = icc_signature.size() + 2;
        header.embedded = curve_of_icc_profile(segment.part(start, segment.size() - start));
    }
}

}  // namespace

PictureHeader inspect_jpeg(Bytes bytes, const std::string& file) {
    const ByteReader jpeg(bytes, ByteReader::Order::big, file);
    PictureHeader header;
    for (std::size_t offset = 2;;) {
        if (jpeg.u8(offset) != marker_prefix) throw bad_picture(file, "is damaged: a JPEG marker is missing");
        const std::uint8_t marker = jpeg.u8(offset + 1);
        if (marker == end_of_image) return header;
        if (marker == marker_prefix) {  // fill byte
            ++offset;
            continue;
        }
        offset += 2;
        if (stands_alone(marker)) continue;
        const std::size_t length = jpeg.u16(offset);
        if (length < 2) throw bad_picture(file, "is damaged: a JPEG segment has no length");
        read_segment(ByteReader(jpeg.part(offset + 2, length - 2), ByteReader::Order::big, file), marker, header);
        offset += length;
        if (marker == start_of_scan) offset = end_of_scan(jpeg, offset);
    }
}

}  // namespace darkbox
