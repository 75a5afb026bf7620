#include "processing/formats/picture_rows.h"

#include <fmt/format.h>

#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>

#include "processing/formats/atomic_file.h"
#include "processing/formats/picture.h"
#include "processing/formats/picture_header.h"
#include "processing/formats/row_decoders.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

class WholePicture : public PictureRows {
public:
    explicit WholePicture(cv::Mat samples)
        : PictureRows(samples.size(), samples.type()), samples_(std::move(samples)) {}

    void read(cv::Mat& rows) override {
        samples_.rowRange(next_, next_ + rows.rows).copyTo(rows);
        next_ += rows.rows;
    }

private:
    cv::Mat samples_;
    int next_ = 0;
};

}  // namespace

FileHandle open_for_reading(const fs::path& path) {
    std::error_code error;
    const fs::file_status status = fs::status(path, error);
    if (status.type() == fs::file_type::not_found)
        throw InputError(fmt::format("{} does not exist", path.string()), "check the path");
    if (!fs::is_regular_file(status))
        throw InputError(fmt::format("{} is not a file", path.string()), "give the path of a file");
    FileHandle file(std::fopen(path.c_str(), "rbe"));
    if (!file)
        throw InputError(fmt::format("cannot open {}: {}", path.string(), std::strerror(errno)),
                         errno == EMFILE ? "allow more open files with 'ulimit -n'" : "check its permissions");
    return file;
}

std::unique_ptr<PictureRows> rows_of(cv::Mat samples) { return std::make_unique<WholePicture>(std::move(samples)); }

std::unique_ptr<PictureRows> open_picture_rows(const fs::path& path) {
    std::array<std::byte, 8> start{};
    const std::size_t read = std::fread(start.data(), 1, start.size(), open_for_reading(path).get());
    switch (require_picture_format(Bytes(start).first(read), path.string())) {
        case PictureFormat::png:
            return open_png_rows(path);
        case PictureFormat::jpeg:
            return open_jpeg_rows(path);
        case PictureFormat::exr:
            return open_exr_rows(path);
        default:
            return open_tiff_rows(path);
    }
}

}  // namespace darkbox
