#pragma once

#include <filesystem>
#include <memory>
#include <opencv2/core.hpp>

namespace darkbox {

/// A picture file read once from the top, some rows at a time: its decoder stays open between them, so that no more
/// than the rows asked for is ever held decoded. Interlaced PNG, progressive JPEG and unusual TIFF (palettes, separate
/// planes, odd bit depths) are the exceptions: their decoders need the whole picture. Thread-compatible.
class PictureRows {
public:
    virtual ~PictureRows() = default;

    cv::Size size() const { return size_; }
    /// CV_8UC3, CV_16UC3 or CV_32FC3: samples as stored, channels R, G, B; grey is replicated, alpha left out.
    int type() const { return type_; }

    /// Decodes the next rows.rows rows into `rows`, which is of size().width and type(). Throws InputError that names
    /// the file when it is cut short or damaged there, or holds a sample that is not finite.
    virtual void read(cv::Mat& rows) = 0;

protected:
    PictureRows(cv::Size size, int type) : size_(size), type_(type) {}

private:
    cv::Size size_;
    int type_;
};

/// PNG, TIFF, JPEG or EXR, told by the content. Throws InputError that names the file, as read_picture() does; damage
/// further down is found on the way.
std::unique_ptr<PictureRows> open_picture_rows(const std::filesystem::path& path);

}  // namespace darkbox
