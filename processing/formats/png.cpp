#include "processing/formats/png.h"

#include <fmt/format.h>

#include "processing/formats/atomic_file.h"
#include "processing/formats/picture_header.h"
#include "processing/formats/row_decoders.h"

namespace darkbox {
namespace {

/// The colour type of the header, which comes first: grey, with alpha or without.
bool is_grey(const ByteReader& png) {
    constexpr std::size_t colour_type = 25;
    return png.u8(colour_type) == 0 || png.u8(colour_type) == 4;
}

}  // namespace

cv::Mat read_png(const std::filesystem::path& path) {
    const std::vector<std::byte> bytes = read_file(path);
    const std::string file = path.string();
    constexpr std::string_view signature = "\x89PNG\r\n\x1a\n";
    const ByteReader png(bytes, ByteReader::Order::big, file);
    if (bytes.size() < signature.size() || png.text(0, 8) != signature) throw bad_picture(file, "is not a PNG picture");
    const PictureHeader header = inspect_png(bytes, file);
    require_sane_size(header.width, header.height, file);
    const std::unique_ptr<PictureRows> rows = open_png_rows(path);
    cv::Mat image(rows->size(), rows->type());
    rows->read(image);
    if (!is_grey(png)) return image;
    cv::Mat grey;
    cv::extractChannel(image, grey, 0);
    return grey;
}

}  // namespace darkbox
