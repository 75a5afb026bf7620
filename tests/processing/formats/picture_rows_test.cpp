#include "processing/formats/picture_rows.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tiffio.h>

#include <filesystem>
#include <limits>
#include <opencv2/imgcodecs.hpp>

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

void expect_as_read_whole(const Path& path) {
    const cv::Mat3f expected = read_picture(path).samples;
    for (const int step : {1, 7, 64, 1000}) {
        const cv::Mat3f rows = read_in_steps(path, step);
        ASSERT_EQ(rows.size(), expected.size());
        EXPECT_LE(cv::norm(rows, expected, cv::NORM_INF), 1e-7) << path << " in steps of " << step;
    }
}

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
    for (const int type : {CV_8UC1, CV_8UC3, CV_16UC1, CV_16UC3, CV_32FC3})
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
    expect_as_read_whole(path("a.exr"));
    write_exr(path("b.exr"), cv::Mat1f(noisy({97, 131}, CV_32FC1)));
    expect_as_read_whole(path("b.exr"));
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
