#include "processing/formats/picture_rows.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <png.h>
#include <tiffio.h>

#include <cstdio>
#include <filesystem>
#include <limits>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>
#include <vector>

#include <jpeglib.h>  // needs <cstdio> before it

#include "processing/formats/atomic_file.h"
#include "processing/formats/exr.h"
#include "processing/formats/picture.h"
#include "tests/support/test_data.h"
#include "tests/support/throws.h"

namespace darkbox {
namespace {

using testing::HasSubstr;
using Path = std::filesystem::path;

/// Noise over a ramp: every sample differs from its neighbours, and JPEG has something to do.
cv::Mat noisy(cv::Size size, int type) {
    cv::Mat image(size, type);
    cv::theRNG().state = 5;
    const double full = image.depth() == CV_8U ? 255 : image.depth() == CV_16U ? 65535 : 1;
    cv::randu(image, cv::Scalar::all(0), cv::Scalar::all(full));
    return image;
}

/// All rows, `step` at a time, as 0...1.
cv::Mat3f read_in_steps(const Path& path, int step) {
    const auto picture = open_picture_rows(path);
    cv::Mat whole;
    for (int y = 0; y < picture->size().height; y += step) {
        cv::Mat rows(std::min(step, picture->size().height - y), picture->size().width, picture->type());
        picture->read(rows);
        whole.push_back(rows);
    }
    cv::Mat3f samples;
    const int depth = CV_MAT_DEPTH(picture->type());
    whole.convertTo(samples, CV_32F, depth == CV_8U ? 1 / 255.0 : depth == CV_16U ? 1 / 65535.0 : 1.0);
    return samples;
}

/// An independent reader's R, G, B as 0...1.
cv::Mat3f read_by_opencv(const Path& path) {
    const cv::Mat bgr =
        cv::imread(path.string(), cv::IMREAD_COLOR | cv::IMREAD_ANYDEPTH | cv::IMREAD_IGNORE_ORIENTATION);
    cv::Mat3f rgb;
    bgr.convertTo(rgb, CV_32F, bgr.depth() == CV_8U ? 1 / 255.0 : bgr.depth() == CV_16U ? 1 / 65535.0 : 1.0);
    cv::cvtColor(rgb, rgb, cv::COLOR_BGR2RGB);
    return rgb;
}

void expect_read(const Path& path, const cv::Mat3f& expected) {
    for (const int step : {1, 7, 64, 1000}) {
        const cv::Mat3f rows = read_in_steps(path, step);
        ASSERT_EQ(rows.size(), expected.size());
        EXPECT_LE(cv::norm(rows, expected, cv::NORM_INF), 1e-7) << path << " in steps of " << step;
    }
}

void expect_as_read_whole(const Path& path) { expect_read(path, read_by_opencv(path)); }

class PictureRowsTest : public testing::Test {
protected:
    Path path(const char* name) const { return folder_.path() / name; }
    Path written(const char* name, const cv::Mat& image, const std::vector<int>& how = {}) const {
        cv::imwrite(path(name).string(), image, how);
        return path(name);
    }
    /// The file without its last third.
    void cut(const Path& file) const { std::filesystem::resize_file(file, std::filesystem::file_size(file) * 2 / 3); }

private:
    test::TemporaryFolder folder_;
};

TEST_F(PictureRowsTest, PngOfEveryKindIsAsReadWhole) {
    for (const int type : {CV_8UC1, CV_8UC3, CV_8UC4, CV_16UC1, CV_16UC3})
        expect_as_read_whole(written("a.png", noisy({97, 131}, type)));
}

TEST_F(PictureRowsTest, TiffOfEveryKindIsAsReadWhole) {
    for (const int type : {CV_8UC1, CV_8UC3, CV_8UC4, CV_16UC1, CV_16UC3, CV_16UC4, CV_32FC3})
        for (const int compression : {COMPRESSION_NONE, COMPRESSION_LZW, COMPRESSION_ADOBE_DEFLATE})
            expect_as_read_whole(written("a.tif", noisy({97, 131}, type), {cv::IMWRITE_TIFF_COMPRESSION, compression}));
}

TEST_F(PictureRowsTest, JpegIsAsReadWhole) {
    expect_as_read_whole(written("a.jpg", noisy({97, 131}, CV_8UC3)));
    expect_as_read_whole(written("b.jpg", noisy({97, 131}, CV_8UC1)));
    expect_as_read_whole(written("c.jpg", noisy({97, 131}, CV_8UC3), {cv::IMWRITE_JPEG_PROGRESSIVE, 1}));
}

TEST_F(PictureRowsTest, ExrIsAsReadWhole) {
    write_exr(path("a.exr"), cv::Mat3f(noisy({97, 131}, CV_32FC3)));
    expect_read(path("a.exr"), read_picture(path("a.exr")).samples);
    write_exr(path("b.exr"), cv::Mat1f(noisy({97, 131}, CV_32FC1)));
    expect_read(path("b.exr"), read_picture(path("b.exr")).samples);
}

TEST_F(PictureRowsTest, InterlacedPngIsAsReadWhole) {
    const cv::Mat3b image = noisy({97, 131}, CV_8UC3);
    std::FILE* file = std::fopen(path("i.png").c_str(), "wb");
    png_structp png = ::png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
    png_infop info = ::png_create_info_struct(png);
    ::png_init_io(png, file);
    ::png_set_IHDR(png, info, 97, 131, 8, PNG_COLOR_TYPE_RGB, PNG_INTERLACE_ADAM7, PNG_COMPRESSION_TYPE_DEFAULT,
                   PNG_FILTER_TYPE_DEFAULT);
    ::png_write_info(png, info);
    std::vector<png_bytep> rows;
    for (int y = 0; y < image.rows; ++y) rows.push_back(const_cast<png_bytep>(image.ptr(y)));
    ::png_write_image(png, rows.data());
    ::png_write_end(png, nullptr);
    ::png_destroy_write_struct(&png, &info);
    std::fclose(file);
    cv::Mat3f expected;
    image.convertTo(expected, CV_32F, 1 / 255.0);
    expect_read(path("i.png"), expected);
    cut(path("i.png"));
    EXPECT_THAT(test::input_error_of([&] { read_in_steps(path("i.png"), 16); }), HasSubstr("i.png"));
}

TEST_F(PictureRowsTest, InksOfACmykJpegAreColours) {
    const cv::Vec4b paper[] = {{255, 255, 255, 255}, {0, 255, 255, 255}, {255, 255, 255, 51}, {102, 51, 255, 127}};
    std::FILE* file = std::fopen(path("k.jpg").c_str(), "wb");
    jpeg_compress_struct codec;
    jpeg_error_mgr errors;
    codec.err = ::jpeg_std_error(&errors);
    jpeg_create_compress(&codec);
    ::jpeg_stdio_dest(&codec, file);
    codec.image_width = 64;
    codec.image_height = 64;
    codec.input_components = 4;
    codec.in_color_space = JCS_CMYK;
    ::jpeg_set_defaults(&codec);  // with Adobe's marker: what the inks let through
    ::jpeg_set_quality(&codec, 100, TRUE);
    ::jpeg_start_compress(&codec, TRUE);
    for (int y = 0; y < 64; ++y) {
        std::vector<cv::Vec4b> row(64, paper[y / 16]);
        JSAMPROW samples = row.front().val;
        ::jpeg_write_scanlines(&codec, &samples, 1);
    }
    ::jpeg_finish_compress(&codec);
    ::jpeg_destroy_compress(&codec);
    std::fclose(file);
    const cv::Mat3f read = read_in_steps(path("k.jpg"), 7);
    for (int band = 0; band < 4; ++band)
        for (int c = 0; c < 3; ++c)
            EXPECT_NEAR(read(16 * band + 8, 30)[c], paper[band][c] * paper[band][3] / (255.0 * 255.0), 2.0 / 255)
                << band;
}

TEST_F(PictureRowsTest, PaletteTiffIsColours) {
    TIFF* tiff = ::TIFFOpen(path("p.tif").c_str(), "w");
    for (const auto& [tag, value] : {std::pair{TIFFTAG_IMAGEWIDTH, 16},
                                     {TIFFTAG_IMAGELENGTH, 4},
                                     {TIFFTAG_BITSPERSAMPLE, 8},
                                     {TIFFTAG_SAMPLESPERPIXEL, 1},
                                     {TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_PALETTE},
                                     {TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG},
                                     {TIFFTAG_ROWSPERSTRIP, 4}})
        ::TIFFSetField(tiff, static_cast<ttag_t>(tag), value);
    std::vector<std::uint16_t> red(256), green(256), blue(256);
    for (std::size_t i = 0; i < 256; ++i) {
        red[i] = static_cast<std::uint16_t>(257 * i);
        green[i] = static_cast<std::uint16_t>(257 * (255 - i));
        blue[i] = static_cast<std::uint16_t>(257 * ((7 * i) % 256));
    }
    ::TIFFSetField(tiff, TIFFTAG_COLORMAP, red.data(), green.data(), blue.data());
    cv::Mat1b index(4, 16);
    for (int i = 0; i < 64; ++i) index.data[i] = static_cast<uchar>(4 * i);
    for (int y = 0; y < 4; ++y) ::TIFFWriteScanline(tiff, index.ptr(y), static_cast<std::uint32_t>(y), 0);
    ::TIFFClose(tiff);
    cv::Mat3f expected(4, 16);
    for (int i = 0; i < 64; ++i)
        expected(i / 16, i % 16) = cv::Vec3f(cv::Vec3i(4 * i, 255 - 4 * i, 28 * i % 256)) / 255.0F;
    expect_read(path("p.tif"), expected);
}

TEST_F(PictureRowsTest, TiledTiffIsPutTogether) {
    const cv::Mat3w image = noisy({150, 100}, CV_16UC3);
    TIFF* tiff = ::TIFFOpen(path("t.tif").c_str(), "w");
    for (const auto& [tag, value] : {std::pair{TIFFTAG_IMAGEWIDTH, 150},
                                     {TIFFTAG_IMAGELENGTH, 100},
                                     {TIFFTAG_TILEWIDTH, 64},
                                     {TIFFTAG_TILELENGTH, 32},
                                     {TIFFTAG_BITSPERSAMPLE, 16},
                                     {TIFFTAG_SAMPLESPERPIXEL, 3},
                                     {TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_RGB},
                                     {TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG},
                                     {TIFFTAG_COMPRESSION, COMPRESSION_LZW}})
        ::TIFFSetField(tiff, static_cast<ttag_t>(tag), value);
    for (int y = 0; y < 100; y += 32)
        for (int x = 0; x < 150; x += 64) {
            cv::Mat3w tile(32, 64, cv::Vec3w::all(0));
            const cv::Rect part(x, y, std::min(64, 150 - x), std::min(32, 100 - y));
            image(part).copyTo(tile(cv::Rect(cv::Point(), part.size())));
            ::TIFFWriteTile(tiff, tile.data, static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y), 0, 0);
        }
    ::TIFFClose(tiff);
    cv::Mat3f expected;
    image.convertTo(expected, CV_32F, 1 / 65535.0);
    for (const int step : {1, 50, 100})
        EXPECT_LE(cv::norm(read_in_steps(path("t.tif"), step), expected, cv::NORM_INF), 1e-7);
}

TEST_F(PictureRowsTest, ACutFileIsNamedWhereverItEnds) {
    write_exr(path("cut.exr"), cv::Mat3f(noisy({97, 131}, CV_32FC3)));
    for (const Path& file :
         {written("cut.png", noisy({97, 131}, CV_16UC3)), written("cut.jpg", noisy({97, 131}, CV_8UC3)),
          written("cut.tif", noisy({97, 131}, CV_16UC3)), path("cut.exr")}) {
        cut(file);
        EXPECT_THAT(test::input_error_of([&] { read_in_steps(file, 16); }), HasSubstr(file.string()));
    }
}

TEST_F(PictureRowsTest, SamplesThatAreNotFiniteAreNamedByTheirPlaceInThePicture) {
    cv::Mat3f image(noisy({20, 40}, CV_32FC3));
    image(33, 7)[1] = std::numeric_limits<float>::infinity();
    write_exr(path("i.exr"), image);
    EXPECT_THAT(test::input_error_of([&] { read_in_steps(path("i.exr"), 16); }), HasSubstr("(7, 33)"));
    image(33, 7)[1] = std::numeric_limits<float>::quiet_NaN();
    const Path plain = written("n.tif", image, {cv::IMWRITE_TIFF_COMPRESSION, COMPRESSION_NONE});
    EXPECT_THAT(test::input_error_of([&] { read_in_steps(plain, 16); }), HasSubstr("(7, 33)"));
}

TEST_F(PictureRowsTest, WhatIsNoPictureIsRefused) {
    write_file(path("a.png"), "hello");
    EXPECT_THAT(test::input_error_of([&] { open_picture_rows(path("a.png")); }), HasSubstr("not a picture"));
    write_file(path("b.png"), "");
    EXPECT_THAT(test::input_error_of([&] { open_picture_rows(path("b.png")); }), HasSubstr("is empty"));
    EXPECT_THAT(test::input_error_of([&] { open_picture_rows(path("none.png")); }), HasSubstr("does not exist"));
}

}  // namespace
}  // namespace darkbox
