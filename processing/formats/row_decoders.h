#pragma once

#include <cstdio>
#include <filesystem>
#include <memory>

#include "processing/formats/picture_rows.h"

namespace darkbox {

struct FileCloser {
    void operator()(std::FILE* file) const noexcept { std::fclose(file); }
};
using FileHandle = std::unique_ptr<std::FILE, FileCloser>;

/// For reading from the start. Throws InputError that names the file.
FileHandle open_for_reading(const std::filesystem::path& path);

// One decoder for each format; open_picture_rows() picks it.

std::unique_ptr<PictureRows> open_png_rows(const std::filesystem::path& path);
std::unique_ptr<PictureRows> open_jpeg_rows(const std::filesystem::path& path);
std::unique_ptr<PictureRows> open_tiff_rows(const std::filesystem::path& path);
std::unique_ptr<PictureRows> open_exr_rows(const std::filesystem::path& path);
/// Of samples that are decoded already: for what cannot be decoded row by row.
std::unique_ptr<PictureRows> rows_of(cv::Mat samples);

}  // namespace darkbox
