#include "processing/formats/png.h"

#include <fmt/format.h>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "processing/formats/atomic_file.h"
#include "processing/formats/picture_header.h"

namespace darkbox {

std::vector<std::byte> encode_jpeg(const cv::Mat3b& image, int quality) {
    std::vector<uchar> bytes;
    cv::Mat3b bgr;
    if (!image.empty()) cv::cvtColor(image, bgr, cv::COLOR_RGB2BGR);
    if (image.empty() || !cv::imencode(".jpg", bgr, bytes, {cv::IMWRITE_JPEG_QUALITY, quality}))
        throw InputError(fmt::format("cannot encode a picture of {}x{} pixels", image.cols, image.rows),
                         "report this as a bug");
    const auto* first = reinterpret_cast<const std::byte*>(bytes.data());
    return {first, first + bytes.size()};
}

cv::Mat read_png(const std::filesystem::path& path) {
    const std::vector<std::byte> bytes = read_file(path);
    const std::string file = path.string();
    constexpr std::string_view signature = "\x89PNG\r\n\x1a\n";
    if (bytes.size() < signature.size() || ByteReader(bytes, ByteReader::Order::big, file).text(0, 8) != signature)
        throw bad_picture(file, "is not a PNG picture");
    const PictureHeader header = inspect_png(bytes, file);
    require_sane_size(header.width, header.height, file);
    const cv::Mat buffer(1, static_cast<int>(bytes.size()), CV_8U, const_cast<std::byte*>(bytes.data()));
    cv::Mat image = cv::imdecode(buffer, cv::IMREAD_UNCHANGED);
    if (image.empty()) throw bad_picture(file, "is damaged: it cannot be decoded");
    if (image.channels() == 4)
        cv::cvtColor(image, image, cv::COLOR_BGRA2RGB);
    else if (image.channels() == 3)
        cv::cvtColor(image, image, cv::COLOR_BGR2RGB);
    return image;
}

}  // namespace darkbox
