#include "acquisition/frame/pixel_format.h"

#include <gmock/gmock.h>

#include <array>

namespace darkbox {
namespace {

constexpr std::array formats{PixelFormat::grey8, PixelFormat::grey16, PixelFormat::rgb8, PixelFormat::rgb16};

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
}

}  // namespace
}  // namespace darkbox
