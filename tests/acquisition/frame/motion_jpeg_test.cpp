#include "acquisition/frame/motion_jpeg.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <cstring>

#include "acquisition/frame/error.h"
#include "tests/support/jpeg_stream.h"

namespace darkbox {
namespace {

using test::jpeg_of;

constexpr int width = 48, height = 32;

std::vector<std::uint16_t> words_of(const std::vector<std::byte>& bytes) {
    std::vector<std::uint16_t> words(bytes.size() / 2);
    std::memcpy(words.data(), bytes.data(), bytes.size());
    return words;
}

std::vector<std::byte> flat(unsigned char code) {
    return jpeg_of(std::vector<unsigned char>(std::size_t{3} * width * height, code), width, height, 100);
}

/// Rises to the right and downwards.
std::vector<std::byte> ramp() {
    std::vector<unsigned char> rgb;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            for (int c = 0; c < 3; ++c) rgb.push_back(static_cast<unsigned char>(10 + 3 * x + 2 * y));
    return jpeg_of(rgb, width, height);
}

TEST(MotionJpeg, IsLinearLight) {
    for (const auto& [code, light] :
         {std::pair<unsigned char, double>{0, 0.0}, {10, 0.0030353}, {128, 0.2158605}, {188, 0.5028865}, {255, 1.0}})
        for (const std::uint16_t sample : words_of(decode_motion_jpeg(flat(code), width, height, 0, height)))
            ASSERT_NEAR(sample / 65535.0, light, 1e-5) << int{code};
}

TEST(MotionJpeg, MayLackTheStandardTables) {
    const auto jpeg = ramp();
    const auto bare = test::without_tables(jpeg);
    ASSERT_LT(bare.size() + 300, jpeg.size());
    EXPECT_EQ(decode_motion_jpeg(bare, width, height, 0, height), decode_motion_jpeg(jpeg, width, height, 0, height));
}

TEST(MotionJpeg, GivesTheRowsThatAreAskedFor) {
    const auto jpeg = ramp();
    const auto whole = decode_motion_jpeg(jpeg, width, height, 0, height);
    const std::size_t row = std::size_t{6} * width;
    for (const auto& [first, rows] : {std::pair{0, 1}, {7, 9}, {height - 1, 1}, {3, height - 3}}) {
        const auto band = decode_motion_jpeg(jpeg, width, height, first, rows);
        ASSERT_EQ(band.size(), row * static_cast<std::size_t>(rows));
        EXPECT_EQ(std::memcmp(band.data(), whole.data() + row * static_cast<std::size_t>(first), band.size()), 0);
    }
}

TEST(MotionJpeg, CutShortAnywhereIsRefused) {
    const auto jpeg = ramp();
    for (std::size_t size = 0; size + 2 < jpeg.size(); size += 7)
        EXPECT_THROW(decode_motion_jpeg(std::span(jpeg).first(size), width, height, 0, height), InputError) << size;
    EXPECT_NO_THROW(decode_motion_jpeg(jpeg, width, height, 0, height));
}

TEST(MotionJpeg, OfAnotherSizeOrNoneIsRefused) {
    EXPECT_THROW(decode_motion_jpeg(ramp(), width + 1, height, 0, height), InputError);
    EXPECT_THROW(decode_motion_jpeg(ramp(), width, height - 1, 0, height - 1), InputError);
    EXPECT_THROW(decode_motion_jpeg(std::vector<std::byte>(5000), width, height, 0, height), InputError);
}

TEST(MotionJpeg, AnyBytesAreRefusedOrDecoded) {
    auto jpeg = ramp();
    for (std::size_t at = 0; at < jpeg.size(); at += 3) {
        auto damaged = jpeg;
        damaged[at] ^= std::byte{0x55};
        try {
            EXPECT_EQ(decode_motion_jpeg(damaged, width, height, 0, height).size(), std::size_t{6} * width * height);
        } catch (const InputError&) {
        }
    }
}

}  // namespace
}  // namespace darkbox
