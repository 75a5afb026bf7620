#include "acquisition/camera/sensor_layout.h"

#include <gmock/gmock.h>

#include <set>
#include <string>
#include <vector>

#include "acquisition/frame/error.h"

namespace darkbox {
namespace {

std::vector<std::byte> bytes_of(std::initializer_list<int> values) {
    std::vector<std::byte> bytes;
    for (const int value : values) bytes.push_back(static_cast<std::byte>(value));
    return bytes;
}

std::vector<std::byte> words_of(std::initializer_list<int> values) {
    std::vector<std::byte> bytes;
    for (const int value : values) {
        bytes.push_back(static_cast<std::byte>(value & 255));
        bytes.push_back(static_cast<std::byte>(value >> 8));
    }
    return bytes;
}

/// "1010 1111 ..." as bytes: the patterns below are written bit by bit as the kernel's tables show them.
std::vector<std::byte> bits(const std::string& text) {
    std::vector<std::byte> bytes;
    int count = 0, value = 0;
    for (const char c : text) {
        if (c == ' ') continue;
        value = value * 2 + (c == '1' ? 1 : 0);
        if (++count % 8 == 0) {
            bytes.push_back(static_cast<std::byte>(value));
            value = 0;
        }
    }
    EXPECT_EQ(count % 8, 0);
    return bytes;
}

SensorLayout layout(const std::string& name, int width, int height, std::size_t bytes_per_line) {
    const auto format = sensor_format(fourcc_from_name(name).value());
    EXPECT_TRUE(format) << name;
    return {format.value_or(SensorFormat{}), width, height, bytes_per_line};
}

TEST(SensorLayout, BytesStayAsTheyAre) {
    EXPECT_EQ(unpack(layout("GREY", 2, 2, 2), bytes_of({1, 2, 253, 254})), bytes_of({1, 2, 253, 254}));
    for (const char* name : {"RGGB", "GRBG", "GBRG", "BA81"})
        EXPECT_EQ(unpack(layout(name, 2, 2, 2), bytes_of({9, 8, 7, 6})), bytes_of({9, 8, 7, 6})) << name;
    EXPECT_EQ(unpack(layout("RGB3", 2, 1, 6), bytes_of({1, 2, 3, 4, 5, 6})), bytes_of({1, 2, 3, 4, 5, 6}));
}

TEST(SensorLayout, WordsAreLittleEndianAndRightAligned) {
    const auto payload = bytes_of({0x34, 0x02, 0xFF, 0x03});
    for (const char* name : {"Y10", "Y12", "Y16", "BG10", "GB10", "BA10", "RG10", "BG12", "GB12", "BA12", "RG12",
                             "BYR2", "GB16", "GR16", "RG16"})
        EXPECT_EQ(unpack(layout(name, 2, 1, 4), payload), words_of({0x234, 0x3FF})) << name;
}

TEST(SensorLayout, TenBitsAsMipiPacksThem) {
    // Samples 10'0000'0001, 01'0000'0010, 11'1111'1111, 00'1100'1100. Lower bits: 11'10'01 ... sample 3 in bits 7, 6.
    const auto payload = bits("10000000 01000000 11111111 00110011 00 11 10 01");
    for (const char* name : {"Y10P", "pBAA", "pGAA", "pgAA", "pRAA"})
        EXPECT_EQ(unpack(layout(name, 4, 1, 5), payload), words_of({0x201, 0x102, 0x3FF, 0x0CC})) << name;
}

TEST(SensorLayout, TwelveBitsAsMipiPacksThem) {
    // Samples 1000'0000'0001 and 0111'0110'1010: upper eight bits, upper eight bits, lower four of 1 then of 0.
    const auto payload = bits("10000000 01110110 1010 0001");
    for (const char* name : {"Y12P", "pBCC", "pGCC", "pgCC", "pRCC"})
        EXPECT_EQ(unpack(layout(name, 2, 1, 3), payload), words_of({0x801, 0x76A})) << name;
}

TEST(SensorLayout, TenBitsWithoutGaps) {
    const auto payload = bits("1000000001 0100000010 1111111111 0011001100");
    EXPECT_EQ(unpack(layout("Y10B", 4, 1, 5), payload), words_of({0x201, 0x102, 0x3FF, 0x0CC}));
    EXPECT_EQ(unpack(layout("Y10B", 1, 1, 2), bits("1000000001 111111")), words_of({0x201}));
}

TEST(SensorLayout, AGroupMayBeCutByTheRowsEnd) {
    const auto ten = bits(
        "10000000 01000000 00000000 00000000 00 00 10 01"
        "11111111 00000000 00000000 00000000 00 00 00 10");
    EXPECT_EQ(unpack(layout("Y10P", 1, 2, 5), ten), words_of({0x201, 0x3FE}));
    const auto twelve = bits("10000000 00000000 0000 0001 11111111 00000000 0000 1110");
    EXPECT_EQ(unpack(layout("pRCC", 1, 2, 3), twelve), words_of({0x801, 0xFFE}));
}

TEST(SensorLayout, EveryPaddedRowIsHonoured) {
    const auto payload = bytes_of({1, 2, 99, 99, 3, 4, 99, 99, 5, 6});  // the last row's padding is not there
    EXPECT_EQ(unpack(layout("GREY", 2, 3, 4), payload), bytes_of({1, 2, 3, 4, 5, 6}));
    EXPECT_EQ(unpack(layout("Y16", 1, 2, 4), bytes_of({1, 2, 9, 9, 3, 4})), words_of({0x201, 0x403}));
}

TEST(SensorLayout, YuyvStays) {
    const auto payload = bytes_of({10, 128, 20, 129, 99, 99, 30, 130, 40, 131});
    EXPECT_EQ(unpack(layout("YUYV", 2, 2, 6), payload), bytes_of({10, 128, 20, 129, 30, 130, 40, 131}));
}

TEST(SensorLayout, Nv12BringsItsChromaBesideTheLuma) {
    const auto payload = bytes_of({1,  2,  3,  4,  99,  //
                                   5,  6,  7,  8,  99,  //
                                   9,  10, 11, 12, 99,  //
                                   20, 21, 22, 23, 99,  // Cb Cr Cb Cr of rows 0 and 1
                                   30, 31, 32, 33});    // of row 2
    EXPECT_EQ(unpack(layout("NV12", 4, 3, 5), payload),
              bytes_of({1, 20, 2, 21, 3, 22, 4, 23, 5, 20, 6, 21, 7, 22, 8, 23, 9, 30, 10, 31, 11, 32, 12, 33}));
}

/// Exactly enough is taken; one byte less is refused by every format.
TEST(SensorLayout, ShortPayloadsAreRefused) {
    for (const SensorFormat& format : sensor_formats()) {
        if (format.packing == Packing::jpeg) continue;  // motion_jpeg_test
        const SensorLayout each{format, 6, 4, row_bytes(format, 6) + 3};
        std::vector<std::byte> payload(payload_bytes(each));
        const std::size_t samples = std::size_t{24} * channels(format.format) * bytes_per_sample(format.format);
        EXPECT_EQ(unpack(each, payload).size(), samples) << fourcc_name(format.fourcc);
        payload.pop_back();
        EXPECT_THROW(unpack(each, payload), InputError) << fourcc_name(format.fourcc);
    }
}

TEST(SensorLayout, ImpossibleLayoutsAreRefused) {
    const std::vector<std::byte> plenty(1000);
    EXPECT_THROW(unpack(layout("GREY", 8, 2, 7), plenty), InputError);
    EXPECT_THROW(unpack(layout("pRAA", 8, 2, 9), plenty), InputError);
    EXPECT_THROW(unpack(layout("YUYV", 3, 2, 8), plenty), InputError);
    EXPECT_THROW(unpack(layout("NV12", 3, 2, 8), plenty), InputError);
    EXPECT_THROW(unpack(layout("GREY", 0, 2, 8), plenty), InputError);
}

TEST(SensorLayout, MosaicsAreThoseOfTheirCodes) {
    EXPECT_EQ(layout("BA81", 2, 2, 2).format.format, PixelFormat::bggr8);
    EXPECT_EQ(layout("BYR2", 2, 2, 4).format.format, PixelFormat::bggr16);
    EXPECT_EQ(layout("BA10", 2, 2, 4).format.format, PixelFormat::grbg16);
    EXPECT_EQ(layout("BG10", 2, 2, 4).format.format, PixelFormat::bggr16);
    EXPECT_EQ(layout("pgAA", 2, 2, 5).format.format, PixelFormat::grbg16);
    EXPECT_EQ(layout("pGCC", 2, 2, 3).format.format, PixelFormat::gbrg16);
    EXPECT_EQ(layout("pRCC", 2, 2, 3).format.bit_depth, 12);
}

TEST(SensorLayout, EveryFormatIsListedOnce) {
    std::set<std::uint32_t> codes;
    for (const SensorFormat& format : sensor_formats()) EXPECT_TRUE(codes.insert(format.fourcc).second);
    EXPECT_FALSE(sensor_format(fourcc_from_name("H264").value()));
    EXPECT_EQ(fourcc_name(fourcc_from_name("Y16").value()), "Y16");
    EXPECT_FALSE(fourcc_from_name("TOOLONG"));
    EXPECT_FALSE(fourcc_from_name(""));
}

}  // namespace
}  // namespace darkbox
