#include <algorithm>
#include <map>
#include <vector>

#include "processing/formats/icc_profile.h"
#include "processing/formats/picture_header.h"

namespace darkbox {
namespace {

// TIFF 6.0 tags.
constexpr int image_width = 256, image_length = 257, bits_per_sample = 258, strip_offsets = 273, strip_sizes = 279,
              tile_offsets = 324, tile_sizes = 325, sample_format = 339, icc_profile = 34675;
constexpr std::uint64_t float_samples = 3;
constexpr std::uint64_t most_values = 1 << 26;

/// Where the two flavours differ: classic TIFF counts in 4 bytes, BigTIFF in 8.
struct Layout {
    int count_width;    ///< of a directory's number of entries
    int value_width;    ///< of offsets and counts of values
    std::size_t entry;  ///< bytes of an entry
};
constexpr Layout classic{2, 4, 12};
constexpr Layout big{8, 8, 20};

struct Entry {
    int type = 0;
    std::uint64_t count = 0;
    std::size_t at = 0;  ///< where its values start
};

int width_of(int type) {
    switch (type) {
        case 3:
        case 8:
            return 2;
        case 4:
        case 9:
        case 11:
            return 4;
        case 5:
        case 10:
        case 12:
        case 16:
        case 17:
        case 18:
            return 8;
        default:
            return 1;
    }
}

std::map<int, Entry> read_directory(const ByteReader& tiff, const Layout& layout) {
    const std::size_t start = tiff.number(layout.count_width == 2 ? 4 : 8, layout.value_width);
    const std::uint64_t entries = tiff.number(start, layout.count_width);
    std::map<int, Entry> directory;
    for (std::uint64_t i = 0; i < entries; ++i) {
        const std::size_t at = start + static_cast<std::size_t>(layout.count_width) + i * layout.entry;
        Entry entry{tiff.u16(at + 2), tiff.number(at + 4, layout.value_width),
                    at + 4 + static_cast<std::size_t>(layout.value_width)};
        if (entry.count > most_values) throw bad_picture(tiff.file(), "is damaged: its TIFF directory makes no sense");
        if (entry.count * static_cast<std::uint64_t>(width_of(entry.type)) >
            static_cast<std::uint64_t>(layout.value_width))
            entry.at = tiff.number(entry.at, layout.value_width);
        directory.emplace(tiff.u16(at), entry);
    }
    return directory;
}

/// A TIFF's first directory and its values by tag.
class Directory {
public:
    Directory(const ByteReader& tiff, const Layout& layout) : tiff_(tiff), entries_(read_directory(tiff, layout)) {}

    bool has(int tag) const { return entries_.contains(tag); }
    std::vector<std::uint64_t> values(int tag) const {
        const auto found = entries_.find(tag);
        if (found == entries_.end()) return {};
        const Entry& entry = found->second;
        const int width = width_of(entry.type);
        tiff_.part(entry.at, entry.count * static_cast<std::size_t>(width));
        std::vector<std::uint64_t> values(entry.count);
        for (std::size_t i = 0; i < values.size(); ++i)
            values[i] = tiff_.number(entry.at + i * static_cast<std::size_t>(width), width);
        return values;
    }
    std::uint64_t first(int tag, std::uint64_t otherwise) const {
        const auto all = values(tag);
        return all.empty() ? otherwise : all.front();
    }
    Bytes raw(int tag) const {
        const auto found = entries_.find(tag);
        return found == entries_.end() ? Bytes() : tiff_.part(found->second.at, found->second.count);
    }

private:
    const ByteReader& tiff_;
    std::map<int, Entry> entries_;
};

/// Every strip or tile lies inside the file.
void require_data(const ByteReader& tiff, const Directory& directory) {
    const bool tiled = directory.has(tile_offsets);
    const auto offsets = directory.values(tiled ? tile_offsets : strip_offsets);
    const auto sizes = directory.values(tiled ? tile_sizes : strip_sizes);
    if (offsets.empty() || offsets.size() != sizes.size())
        throw bad_picture(tiff.file(), "is damaged: its TIFF strips are not listed");
    for (std::size_t i = 0; i < offsets.size(); ++i) tiff.part(offsets[i], sizes[i]);
}

}  // namespace

PictureHeader inspect_tiff(Bytes bytes, const std::string& file) {
    const bool little = std::to_integer<char>(bytes[0]) == 'I';
    const ByteReader tiff(bytes, little ? ByteReader::Order::little : ByteReader::Order::big, file);
    const Directory directory(tiff, tiff.u16(2) == 43 ? big : classic);
    PictureHeader header;
    header.width = directory.first(image_width, 0);
    header.height = directory.first(image_length, 0);
    header.is_float = directory.first(sample_format, 1) == float_samples;
    header.bit_depth = header.is_float ? 32 : directory.first(bits_per_sample, 1) > 8 ? 16 : 8;
    if (directory.has(icc_profile)) header.embedded = curve_of_icc_profile(directory.raw(icc_profile));
    require_data(tiff, directory);
    return header;
}

}  // namespace darkbox
