#include "acquisition/frame/pixel_format.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <string>

namespace darkbox {
namespace {

constexpr std::array formats{PixelFormat::grey8,  PixelFormat::grey16, PixelFormat::rgb8,   PixelFormat::rgb16,
                             PixelFormat::rggb8,  PixelFormat::grbg8,  PixelFormat::gbrg8,  PixelFormat::bggr8,
                             PixelFormat::rggb16, PixelFormat::grbg16, PixelFormat::gbrg16, PixelFormat::bggr16,
                             PixelFormat::ycc8};

TEST(PixelFormat, NamesRoundTrip) {
    for (const PixelFormat format : formats) EXPECT_EQ(pixel_format_from_name(name(format)), format);
    EXPECT_EQ(name(PixelFormat::grey16), "grey16");
    EXPECT_EQ(name(PixelFormat::rgb8), "rgb8");
}

TEST(PixelFormat, OtherNamesHaveNoFormat) {
    for (const char* other : {"", "grey", "GREY8", "grey8 ", "rgb", "png", "grey32"})
        EXPECT_EQ(pixel_format_from_name(other), std::nullopt) << other;
}

TEST(PixelFormat, LayoutOfASample) {
    EXPECT_EQ(channels(PixelFormat::grey8), 1);
    EXPECT_EQ(channels(PixelFormat::grey16), 1);
    EXPECT_EQ(channels(PixelFormat::rgb8), 3);
    EXPECT_EQ(channels(PixelFormat::rgb16), 3);
    EXPECT_EQ(bytes_per_sample(PixelFormat::grey8), 1);
    EXPECT_EQ(bytes_per_sample(PixelFormat::grey16), 2);
    EXPECT_EQ(bytes_per_sample(PixelFormat::rgb8), 1);
    EXPECT_EQ(bytes_per_sample(PixelFormat::rgb16), 2);
    EXPECT_EQ(channels(PixelFormat::ycc8), 2);
    EXPECT_EQ(bytes_per_sample(PixelFormat::ycc8), 1);
}

/// The four letters of a mosaic's name, read in rows of two, say where its red sample lies.
TEST(PixelFormat, MosaicsFollowFromTheirNames) {
    for (const PixelFormat format : formats) {
        const std::string letters(name(format).substr(0, 4));
        const auto red = letters.find('r');
        if (std::count(letters.begin(), letters.end(), 'g') != 2) {
            EXPECT_EQ(mosaic(format), std::nullopt) << letters;
            continue;
        }
        EXPECT_EQ(channels(format), 1) << letters;
        EXPECT_EQ(bytes_per_sample(format), name(format).ends_with("16") ? 2 : 1) << letters;
        EXPECT_EQ(mosaic(format), (Mosaic{static_cast<int>(red) / 2, static_cast<int>(red) % 2})) << letters;
    }
}

}  // namespace
}  // namespace darkbox
