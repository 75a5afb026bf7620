#include "processing/formats/picture.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <opencv2/imgcodecs.hpp>

#include "processing/formats/atomic_file.h"
#include "processing/formats/exr.h"
#include "processing/formats/png.h"
#include "tests/support/test_data.h"
#include "tests/support/throws.h"

namespace darkbox {
namespace {

using test::input_error_of;
using testing::HasSubstr;
namespace fs = std::filesystem;

/// Red grows to the right, green downwards, blue is constant: a swap of channels or axes shows.
template <class Sample>
cv::Mat gradient(int type, double full) {
    cv::Mat image(40, 60, type);
    for (int y = 0; y < image.rows; ++y)
        for (int x = 0; x < image.cols; ++x)
            image.at<cv::Vec<Sample, 3>>(y, x) = {cv::saturate_cast<Sample>(full * 0.25),
                                                  cv::saturate_cast<Sample>(full * y / 39),
                                                  cv::saturate_cast<Sample>(full * x / 59)};  // B, G, R for the codec
    return image;
}

std::vector<std::byte> encoded(const std::string& extension, const cv::Mat& bgr,
                               const std::vector<int>& parameters = {}) {
    std::vector<uchar> bytes;
    EXPECT_TRUE(cv::imencode(extension, bgr, bytes, parameters));
    const auto* first = reinterpret_cast<const std::byte*>(bytes.data());
    return {first, first + bytes.size()};
}

void expect_gradient(const Picture& picture, double tolerance) {
    ASSERT_EQ(picture.samples.size(), cv::Size(60, 40));
    for (const cv::Point at : {cv::Point(0, 0), cv::Point(59, 0), cv::Point(0, 39), cv::Point(30, 20)}) {
        const cv::Vec3f& p = picture.samples(at);
        EXPECT_NEAR(p[0], at.x / 59.0, tolerance);
        EXPECT_NEAR(p[1], at.y / 39.0, tolerance);
        EXPECT_NEAR(p[2], 0.25, tolerance);
    }
}

class ReadPicture : public testing::Test {
protected:
    fs::path file(const std::string& name, std::span<const std::byte> bytes) {
        write_file(folder_.path() / name, bytes);
        return folder_.path() / name;
    }
    fs::path cut(const std::string& name, std::span<const std::byte> bytes, double share) {
        return file(name, bytes.first(static_cast<std::size_t>(share * static_cast<double>(bytes.size()))));
    }
    test::TemporaryFolder folder_;
};

TEST_F(ReadPicture, EightBitFilesAreReadAsStored) {
    const cv::Mat image = gradient<uchar>(CV_8UC3, 255);
    expect_gradient(read_picture(file("a.png", encoded(".png", image))), 0.5 / 255);
    expect_gradient(read_picture(file("a.tif", encoded(".tiff", image))), 0.5 / 255);
    expect_gradient(read_picture(file("a.jpg", encoded(".jpg", image))), 6.0 / 255);
    EXPECT_EQ(read_picture(folder_.path() / "a.jpg").format, PictureFormat::jpeg);
    EXPECT_EQ(read_picture(folder_.path() / "a.png").bit_depth, 8);
}

TEST_F(ReadPicture, SixteenBitFilesKeepTheirBits) {
    const cv::Mat image = gradient<ushort>(CV_16UC3, 65535);
    for (const std::string extension : {".png", ".tiff"}) {
        const Picture picture = read_picture(file("a" + extension, encoded(extension, image)));
        expect_gradient(picture, 1.0 / 65535);
        EXPECT_EQ(picture.bit_depth, 16);
        EXPECT_FALSE(picture.is_float);
    }
}

TEST_F(ReadPicture, GreyIsReplicated) {
    const cv::Mat grey(5, 7, CV_16U, cv::Scalar(32768));
    const Picture picture = read_picture(file("grey.png", encoded(".png", grey)));
    EXPECT_FLOAT_EQ(picture.samples(2, 3)[0], 32768.0F / 65535.0F);
    EXPECT_EQ(picture.samples(2, 3)[0], picture.samples(2, 3)[2]);
}

TEST_F(ReadPicture, ExrIsRadianceAsStoredAndLinear) {
    cv::Mat3f image(3, 4, cv::Vec3f(0.5F, 2.0F, -0.25F));
    write_exr(folder_.path() / "a.exr", image);
    const Picture picture = read_picture(folder_.path() / "a.exr");
    EXPECT_EQ(picture.samples(1, 2), cv::Vec3f(0.5F, 2.0F, -0.25F));
    EXPECT_TRUE(picture.is_float);
    EXPECT_EQ(picture.embedded, EmbeddedCurve::linear);
    EXPECT_EQ(cv::countNonZero(clipped_samples(picture)), 0);
}

TEST_F(ReadPicture, FloatTiffIsRadianceAsStored) {
    const std::vector<int> uncompressed{cv::IMWRITE_TIFF_COMPRESSION, 1};
    const cv::Mat image(3, 4, CV_32FC3, cv::Scalar(0.25, 1.5, 3.0));
    const Picture picture = read_picture(file("a.tif", encoded(".tiff", image, uncompressed)));
    EXPECT_EQ(picture.samples(1, 1), cv::Vec3f(3.0F, 1.5F, 0.25F));
    EXPECT_EQ(picture.bit_depth, 32);
}

TEST_F(ReadPicture, FullScaleInAnyChannelIsClipped) {
    cv::Mat image(2, 2, CV_8UC3, cv::Scalar::all(100));
    image.at<cv::Vec3b>(1, 0) = {0, 255, 0};
    const cv::Mat1b clipped = clipped_samples(read_picture(file("a.png", encoded(".png", image))));
    EXPECT_EQ(clipped(1, 0), 255);
    EXPECT_EQ(cv::countNonZero(clipped), 1);
}

TEST_F(ReadPicture, CutFilesAreErrorsNotHalfPictures) {
    const cv::Mat image = gradient<uchar>(CV_8UC3, 255);
    for (const std::string extension : {".png", ".jpg", ".tiff"})
        for (const double share : {0.02, 0.3, 0.7, 0.99}) {
            const fs::path path = cut("cut" + extension, encoded(extension, image), share);
            const std::string said = input_error_of([&] { read_picture(path); });
            EXPECT_THAT(said, HasSubstr("cut" + extension)) << share;
        }
}

TEST_F(ReadPicture, CutExrIsAnError) {
    cv::Mat3f noise(64, 64);
    cv::randu(noise, 0, 1);
    write_exr(folder_.path() / "a.exr", noise);
    const auto bytes = read_file(folder_.path() / "a.exr");
    for (const double share : {0.01, 0.3, 0.9}) {
        const fs::path path = cut("cut.exr", bytes, share);
        EXPECT_THAT(input_error_of([&] { read_picture(path); }), HasSubstr("cut.exr"));
    }
}

TEST_F(ReadPicture, DamagedPngIsTold) {
    auto bytes = encoded(".png", gradient<uchar>(CV_8UC3, 255));
    bytes[bytes.size() / 2] ^= std::byte{0x10};
    EXPECT_THAT(input_error_of([&] { read_picture(file("bad.png", bytes)); }), HasSubstr("checksum"));
}

/// Whatever the bytes: a picture or an InputError, never another exception or a crash.
TEST_F(ReadPicture, DamageAnywhereIsAPictureOrAnInputError) {
    write_exr(folder_.path() / "a.exr", cv::Mat3f(40, 60, cv::Vec3f(0.5F, 2.0F, 0.25F)));
    const cv::Mat image = gradient<uchar>(CV_8UC3, 255);
    const std::vector<std::vector<std::byte>> originals{encoded(".png", image), encoded(".jpg", image),
                                                        encoded(".tiff", image), read_file(folder_.path() / "a.exr")};
    std::uint32_t state = 1;
    const auto random = [&state](std::size_t below) {  // Numerical Recipes' generator
        state = state * 1664525U + 1013904223U;
        return static_cast<std::size_t>(state >> 8) % below;
    };
    for (const auto& original : originals)
        for (int round = 0; round < 200; ++round) {
            auto bytes = original;
            for (int k = 0; k < 4; ++k)
                bytes[4 + random(std::min<std::size_t>(bytes.size() - 4, 600))] = std::byte(random(256));
            try {
                read_picture(file("damaged", bytes));
            } catch (const InputError&) {
                continue;
            }
        }
}

TEST_F(ReadPicture, MissingEmptyAndForeignFilesAreNamed) {
    EXPECT_THAT(input_error_of([&] { read_picture(folder_.path() / "none.png"); }), HasSubstr("does not exist"));
    EXPECT_THAT(input_error_of([&] { read_picture(folder_.path()); }), HasSubstr("is not a file"));
    EXPECT_THAT(input_error_of([&] { read_picture(file("empty.png", {})); }), HasSubstr("is empty"));
    write_file(folder_.path() / "text.png", "hello");
    EXPECT_THAT(input_error_of([&] { read_picture(folder_.path() / "text.png"); }), HasSubstr("not a picture"));
}

TEST_F(ReadPicture, TheContentTellsTheFormat) {
    const Picture picture = read_picture(file("really_png.jpg", encoded(".png", gradient<uchar>(CV_8UC3, 255))));
    EXPECT_EQ(picture.format, PictureFormat::png);
}

TEST_F(ReadPicture, AbsurdSizeIsRefusedBeforeItIsAllocated) {
    auto bytes = encoded(".jpg", gradient<uchar>(CV_8UC3, 255));
    for (std::size_t i = 0; i + 9 < bytes.size(); ++i)
        if (bytes[i] == std::byte{0xFF} && bytes[i + 1] == std::byte{0xC0}) {
            for (std::size_t k = 5; k < 9; ++k) bytes[i + k] = std::byte{0xFF};
            break;
        }
    EXPECT_THAT(input_error_of([&] { read_picture(file("huge.jpg", bytes)); }), HasSubstr("65535x65535"));
}

TEST_F(ReadPicture, NotANumberInExrIsAnErrorWithItsPlace) {
    cv::Mat3f image(3, 4, cv::Vec3f(1, 1, 1));
    image(2, 1)[1] = std::numeric_limits<float>::quiet_NaN();
    write_exr(folder_.path() / "nan.exr", image);
    const std::string said = input_error_of([&] { read_picture(folder_.path() / "nan.exr"); });
    EXPECT_THAT(said, HasSubstr("nan.exr"));
    EXPECT_THAT(said, HasSubstr("(1, 2)"));
    image(2, 1)[1] = std::numeric_limits<float>::infinity();
    write_exr(folder_.path() / "inf.exr", image);
    EXPECT_THAT(input_error_of([&] { read_picture(folder_.path() / "inf.exr"); }), HasSubstr("not a finite number"));
}

/// A chunk put right behind IHDR, with its checksum.
std::vector<std::byte> with_chunk(const std::vector<std::byte>& png, std::span<const std::uint8_t> chunk) {
    constexpr std::size_t behind_header = 33;
    std::vector<std::byte> out(png.begin(), png.begin() + behind_header);
    for (const std::uint8_t value : chunk) out.push_back(std::byte{value});
    out.insert(out.end(), png.begin() + behind_header, png.end());
    return out;
}

TEST_F(ReadPicture, EmbeddedCurveOfPngIsFound) {
    const auto png = encoded(".png", gradient<uchar>(CV_8UC3, 255));
    EXPECT_FALSE(read_picture(file("none.png", png)).embedded);
    const std::uint8_t srgb[] = {0, 0, 0, 1, 's', 'R', 'G', 'B', 0, 0xAE, 0xCE, 0x1C, 0xE9};
    EXPECT_EQ(read_picture(file("srgb.png", with_chunk(png, srgb))).embedded, EmbeddedCurve::srgb);
    const std::uint8_t linear[] = {0, 0, 0, 4, 'g', 'A', 'M', 'A', 0, 1, 0x86, 0xA0, 0x31, 0xE8, 0x96, 0x5F};
    EXPECT_EQ(read_picture(file("linear.png", with_chunk(png, linear))).embedded, EmbeddedCurve::linear);
}

TEST_F(ReadPicture, MaskIsCutAtHalf) {
    const cv::Mat edge = (cv::Mat1b(1, 4) << 0, 127, 128, 255);
    write_png(folder_.path() / "mask.png", edge);
    const cv::Mat1b mask = read_mask(folder_.path() / "mask.png");
    EXPECT_EQ(mask(0, 1), 0);
    EXPECT_EQ(mask(0, 2), 255);
    EXPECT_EQ(cv::countNonZero(mask), 2);
}

}  // namespace
}  // namespace darkbox
