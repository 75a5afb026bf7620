#include "acquisition/session/frame_file.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "acquisition/frame/error.h"
#include "tests/acquisition/session/test_frames.h"
#include "tests/support/test_data.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;
using test::noise_frame;
using testing::HasSubstr;

class FrameFile : public testing::TestWithParam<PixelFormat> {
protected:
    void write(std::span<const std::byte> bytes) const {
        std::ofstream(file, std::ios::binary)
            .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    }

    static FrameRecord record_of(const Frame& frame) {
        FrameRecord record;
        record.format = name(frame.format);
        record.width = frame.width;
        record.height = frame.height;
        record.bit_depth = frame.bit_depth;
        record.black_level = frame.black_level;
        return record;
    }

    std::string failure(const FrameRecord& record) const {
        try {
            read_frame(file, record);
        } catch (const InputError& error) {
            EXPECT_THAT(error.what(), HasSubstr(file.string()));
            return error.what();
        }
        return "";
    }

    test::TemporaryFolder folder;
    fs::path file = folder.path() / "frame.tif";
};

TEST_P(FrameFile, RoundTripsBitForBit) {
    for (const auto& [width, height] : {std::pair{1, 1}, {37, 23}, {641, 479}}) {
        const Frame frame = noise_frame(GetParam(), width, height, 5);
        write(encode_frame_tiff(frame));
        const Frame back = read_frame(file, record_of(frame));
        EXPECT_EQ(back.pixels, frame.pixels);
        EXPECT_EQ(back.width, width);
        EXPECT_EQ(back.height, height);
        EXPECT_EQ(back.bit_depth, frame.bit_depth);
        EXPECT_EQ(back.black_level, frame.black_level);
    }
}

TEST_P(FrameFile, ReadsAnyBandOfRows) {
    const Frame frame = noise_frame(GetParam(), 300, 200, 6);
    write(encode_frame_tiff(frame));
    const std::size_t row = frame.pixels.size() / frame.height;
    for (const auto& [first, count] : {std::pair{0, 1}, {0, 200}, {63, 70}, {199, 1}}) {
        const Frame band = read_frame_rows(file, record_of(frame), {first, count});
        ASSERT_EQ(band.height, count);
        ASSERT_EQ(band.pixels.size(), row * count);
        EXPECT_TRUE(std::equal(band.pixels.begin(), band.pixels.end(), frame.pixels.begin() + row * first));
    }
    for (const RowBand outside : {RowBand{-1, 1}, {0, 201}, {200, 1}, {0, 0}, {2147483647, 2147483647}})
        EXPECT_THROW(read_frame_rows(file, record_of(frame), outside), InputError);
}

TEST_P(FrameFile, AnotherProgramSeesTheSamePicture) {
    if (GetParam() == PixelFormat::ycc8) return;  // OpenCV reads no two-channel TIFF
    const Frame frame = noise_frame(GetParam(), 64, 48, 7);
    write(encode_frame_tiff(frame));
    cv::Mat picture = cv::imread(file.string(), cv::IMREAD_UNCHANGED);
    ASSERT_EQ(picture.size(), cv::Size(64, 48));
    ASSERT_EQ(picture.channels(), channels(frame.format));
    if (picture.channels() == 3) {  // OpenCV speaks BGR
        std::vector<cv::Mat> planes;
        cv::split(picture, planes);
        std::swap(planes[0], planes[2]);
        cv::merge(planes, picture);
    }
    const auto* begin = reinterpret_cast<const std::byte*>(picture.data);
    EXPECT_TRUE(std::equal(frame.pixels.begin(), frame.pixels.end(), begin));
}

TEST_P(FrameFile, EncodesTheSameBytesTwice) {
    const Frame frame = noise_frame(GetParam(), 50, 40, 8);
    EXPECT_EQ(encode_frame_tiff(frame), encode_frame_tiff(frame));
}

TEST_P(FrameFile, EveryTruncationIsAnErrorThatNamesTheFile) {
    const Frame frame = noise_frame(GetParam(), 9, 7, 9);
    const std::vector<std::byte> bytes = encode_frame_tiff(frame);
    constexpr std::size_t end_mark = 4;  // "no further picture": libtiff does without
    for (std::size_t length = 0; length + end_mark < bytes.size(); ++length) {
        write(std::span(bytes).first(length));
        EXPECT_NE(failure(record_of(frame)), "") << length << " of " << bytes.size() << " bytes";
    }
}

TEST_P(FrameFile, DamagedBytesNeverCrash) {
    const Frame frame = noise_frame(GetParam(), 9, 7, 9);
    const std::vector<std::byte> good = encode_frame_tiff(frame);
    for (std::size_t at = 0; at < good.size(); ++at) {
        std::vector<std::byte> bytes = good;
        bytes[at] ^= std::byte{0xFF};
        write(bytes);
        failure(record_of(frame));  // either it reads, or it is an InputError
    }
}

TEST_P(FrameFile, RecordOfAnotherPictureIsRefused) {
    const Frame frame = noise_frame(GetParam(), 20, 10, 3);
    write(encode_frame_tiff(frame));
    FrameRecord wrong = record_of(frame);
    wrong.width = 10;
    wrong.height = 20;
    EXPECT_THAT(failure(wrong), HasSubstr("20 x 10"));
    wrong = record_of(frame);
    wrong.format = channels(GetParam()) * bytes_per_sample(GetParam()) == 1 ? "rgb16" : "grey8";
    EXPECT_THAT(failure(wrong), HasSubstr(wrong.format));
    wrong.format = "jpeg";
    EXPECT_THAT(failure(wrong), HasSubstr("jpeg"));
}

INSTANTIATE_TEST_SUITE_P(PixelFormats, FrameFile,
                         testing::Values(PixelFormat::grey8, PixelFormat::grey16, PixelFormat::rgb8, PixelFormat::rgb16,
                                         PixelFormat::grbg8, PixelFormat::bggr16, PixelFormat::ycc8),
                         [](const auto& format) { return std::string(name(format.param)); });

TEST(EncodeFrame, RefusesAFrameWhoseBytesDoNotFit) {
    Frame frame = noise_frame(PixelFormat::grey16, 8, 8, 1);
    frame.pixels.pop_back();
    EXPECT_THROW(encode_frame_tiff(frame), InputError);
    frame = noise_frame(PixelFormat::grey8, 8, 8, 1);
    frame.bit_depth = 12;
    EXPECT_THROW(encode_frame_tiff(frame), InputError);
    EXPECT_THROW(encode_frame_tiff(Frame{}), InputError);
}

}  // namespace
}  // namespace darkbox
