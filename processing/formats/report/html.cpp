#include "processing/formats/report/html.h"

#include <vector>

#include "processing/formats/jpeg_writer.h"
#include "processing/formats/png.h"

namespace darkbox {
namespace {

constexpr int jpeg_quality = 90;
constexpr std::size_t small_enough = 200'000;  // bytes: a PNG below stays a PNG

}  // namespace

std::string escaped(std::string_view text) {
    std::string out;
    out.reserve(text.size());
    for (const char c : text) switch (c) {
            case '&':
                out += "&amp;";
                break;
            case '<':
                out += "&lt;";
                break;
            case '>':
                out += "&gt;";
                break;
            case '"':
                out += "&quot;";
                break;
            case '\'':
                out += "&#39;";
                break;
            default:
                out += c;
        }
    return out;
}

std::string base64(std::span<const std::byte> bytes) {
    constexpr std::string_view digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string out;
    out.reserve((bytes.size() + 2) / 3 * 4);
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        unsigned group = 0;
        for (std::size_t k = 0; k < 3; ++k)
            group = group << 8 | (i + k < bytes.size() ? std::to_integer<unsigned>(bytes[i + k]) : 0U);
        for (std::size_t k = 0; k < 4; ++k) out += i + k > bytes.size() ? '=' : digits[group >> (18 - 6 * k) & 63U];
    }
    return out;
}

std::string data_uri(const cv::Mat3b& image) {
    const std::vector<std::byte> png = encode_png(image);
    if (png.size() <= small_enough) return "data:image/png;base64," + base64(png);
    return "data:image/jpeg;base64," + base64(encode_jpeg(image, jpeg_quality));
}

}  // namespace darkbox
