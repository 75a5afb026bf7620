#include "processing/formats/radiance_hdr.h"

#include <cmath>
#include <cstdio>
#include <vector>

#include "processing/formats/picture_header.h"

namespace darkbox {
namespace {

constexpr int exponent_bias = 128 + 8;  // of a byte as a fraction of 256

/// Reads onwards; past the end the file is cut short.
class Cursor {
public:
    Cursor(Bytes bytes, const std::string& file) : reader_(bytes, ByteReader::Order::big, file) {}

    std::uint8_t next() { return reader_.u8(at_++); }
    std::uint8_t peek(std::size_t ahead) const { return reader_.u8(at_ + ahead); }
    void skip(std::size_t count) { at_ += count; }
    std::string line() {
        std::string text;
        for (char c = 0; (c = static_cast<char>(next())) != '\n';) text += c;
        return text;
    }
    const std::string& file() const { return reader_.file(); }

private:
    ByteReader reader_;
    std::size_t at_ = 0;
};

cv::Size read_header(Cursor& in) {
    if (!in.line().starts_with("#?")) throw bad_picture(in.file(), "is not a Radiance .hdr picture");
    while (!in.line().empty()) continue;
    int width = 0, height = 0;
    if (std::sscanf(in.line().c_str(), "-Y %9d +X %9d", &height, &width) != 2 || width <= 0 || height <= 0)
        throw bad_picture(in.file(), "has rows in an order that darkbox does not read");
    require_sane_size(static_cast<std::uint64_t>(width), static_cast<std::uint64_t>(height), in.file());
    return {width, height};
}

/// One of a row's four planes: runs (count + 128, value) and stretches (count, values).
void read_plane(Cursor& in, std::vector<cv::Vec4b>& row, int channel) {
    for (std::size_t x = 0; x < row.size();) {
        const int code = in.next();
        const bool run = code > 128;
        const auto count = static_cast<std::size_t>(run ? code - 128 : code);
        if (count == 0 || count > row.size() - x) throw bad_picture(in.file(), "is damaged: a run is too long");
        const std::uint8_t repeated = run ? in.next() : std::uint8_t{0};
        for (std::size_t end = x + count; x < end; ++x) row[x][channel] = run ? repeated : in.next();
    }
}

bool is_run_length_encoded(const Cursor& in, std::size_t width) {
    const bool possible = width >= 8 && width < 32768;
    return possible && in.peek(0) == 2 && in.peek(1) == 2 && (in.peek(2) << 8 | in.peek(3)) == static_cast<int>(width);
}

void read_row(Cursor& in, std::vector<cv::Vec4b>& row) {
    if (is_run_length_encoded(in, row.size())) {
        in.skip(4);
        for (int channel = 0; channel < 4; ++channel) read_plane(in, row, channel);
        return;
    }
    for (cv::Vec4b& pixel : row)
        for (int channel = 0; channel < 4; ++channel) pixel[channel] = in.next();
}

cv::Vec3f radiance_of(const cv::Vec4b& pixel) {
    if (pixel[3] == 0) return {0, 0, 0};
    const float scale = std::ldexp(1.0F, pixel[3] - exponent_bias);
    return {static_cast<float>(pixel[0]) * scale, static_cast<float>(pixel[1]) * scale,
            static_cast<float>(pixel[2]) * scale};
}

}  // namespace

cv::Mat3f decode_radiance_hdr(Bytes bytes, const std::string& file) {
    Cursor in(bytes, file);
    const cv::Size size = read_header(in);
    cv::Mat3f image(size);
    std::vector<cv::Vec4b> row(static_cast<std::size_t>(size.width));
    for (int y = 0; y < size.height; ++y) {
        read_row(in, row);
        for (int x = 0; x < size.width; ++x) image(y, x) = radiance_of(row[static_cast<std::size_t>(x)]);
    }
    return image;
}

}  // namespace darkbox
