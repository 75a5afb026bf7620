#include "rig/capture/picture.h"

#include <gmock/gmock.h>

#include <cmath>
#include <numbers>

#include "rig/capture/picture_check.h"
#include "tests/rig/capture/fake_rig.h"

namespace darkbox {
namespace {

constexpr double picture_black = 100;
constexpr double read_noise = 3;    // samples
constexpr double shot_noise = 0.2;  // variance per sample of signal
constexpr double picture_full_scale = 4095;

/// splitmix64 made into normal deviates by Box and Muller's method.
class Deviates {
public:
    explicit Deviates(std::uint64_t seed) : state_(seed) {}
    double next() { return std::sqrt(-2 * std::log(1 - uniform())) * std::cos(2 * std::numbers::pi * uniform()); }

private:
    double uniform() {
        std::uint64_t z = (state_ += 0x9e3779b97f4a7c15u);
        z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
        z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
        return static_cast<double>((z ^ (z >> 31)) >> 11) * 0x1p-53;
    }
    std::uint64_t state_;
};

/// A bumpy matte surface under one distant lamp; `azimuth` and `elevation` in degrees.
struct Light {
    double azimuth = 0;
    double elevation = 45;
    double strength = 1000;
};

Picture shoot(const Light& light, Deviates& noise) {
    Picture picture{320, 240, {}};
    const double a = light.azimuth * std::numbers::pi / 180;
    const double e = light.elevation * std::numbers::pi / 180;
    for (int y = 0; y < picture.rows; ++y) {
        for (int x = 0; x < picture.columns; ++x) {
            const double p = 0.4 * std::cos(x * 0.9);
            const double q = 0.4 * std::cos(y * 0.7 + x * 0.1);
            const double cosine = (p * std::cos(a) * std::cos(e) + q * std::sin(a) * std::cos(e) + std::sin(e)) /
                                  std::sqrt(1 + p * p + q * q);
            const double signal = light.strength * std::max(0.0, cosine);
            const double deviation = std::sqrt(read_noise * read_noise + shot_noise * signal);
            const double sample = picture_black + signal + deviation * noise.next();
            picture.samples.push_back(
                static_cast<std::uint16_t>(std::clamp(std::round(sample), 0.0, picture_full_scale)));
        }
    }
    return picture;
}

const Light no_light{0, 0, 0};

TEST(Noise, IsMeasuredFromTwoExposuresOfOneLight) {
    Deviates noise(1);
    const Picture dark = shoot(no_light, noise);
    const Light light{30, 45, 2000};
    const NoiseModel model = measure_noise(shoot(light, noise), shoot(light, noise), dark, picture_full_scale);
    EXPECT_NEAR(model.slope, shot_noise, 0.05 * shot_noise);
    EXPECT_NEAR(model.variance(1000), read_noise * read_noise + shot_noise * 1000, 8);
}

TEST(Noise, LeavesSaturatedSamplesOut) {
    Deviates noise(2);
    const Picture dark = shoot(no_light, noise);
    const Light light{30, 45, 5000};  // about half the samples clip
    const NoiseModel model = measure_noise(shoot(light, noise), shoot(light, noise), dark, picture_full_scale);
    EXPECT_NEAR(model.variance(2000), shot_noise * 2000, 80);
}

TEST(Comparison, OfOneLightFindsNoiseOnly) {
    Deviates noise(3);
    const Picture dark = shoot(no_light, noise);
    for (const double strength : {10.0, 100.0, 1000.0, 3000.0}) {
        const Light light{75, 50, strength};
        const Picture first = shoot(light, noise);
        const NoiseModel model = measure_noise(first, shoot(light, noise), dark, picture_full_scale);
        const Difference difference = compare(first, shoot(light, noise), dark, model);
        EXPECT_NEAR(difference.gain, 1.0, 0.02) << strength;
        EXPECT_NEAR(difference.pixels.value, 1.0, 0.02 + 4 * difference.pixels.sigma) << strength;
        EXPECT_NEAR(difference.blocks.value, 1.0, 0.1 + 4 * difference.blocks.sigma) << strength;
    }
}

TEST(Comparison, ForgivesAFlickeringLamp) {
    Deviates noise(4);
    const Picture dark = shoot(no_light, noise);
    const Light light{75, 50, 2000};
    const Light brighter{75, 50, 2040};
    const NoiseModel model = measure_noise(shoot(light, noise), shoot(light, noise), dark, picture_full_scale);
    const Difference difference = compare(shoot(brighter, noise), shoot(light, noise), dark, model);
    EXPECT_NEAR(difference.gain, 1.02, 0.002);
    EXPECT_NEAR(difference.pixels.value, 1.0, 0.02 + 4 * difference.pixels.sigma);
    EXPECT_NEAR(difference.blocks.value, 1.0, 0.1 + 4 * difference.blocks.sigma);
}

/// The hardest case: the texture is so fine and so regular that no block of it changes, and the light so faint (0.07 of
/// full scale) that the change of a single sample drowns in noise.
TEST(Comparison, TellsLampsFiveDegreesApartInFaintLight) {
    Deviates noise(5);
    const Picture dark = shoot(no_light, noise);
    for (const double strength : {300.0, 1000.0, 3000.0}) {
        const Light here{0, 50, strength};
        const Light there{5, 50, strength};
        const NoiseModel model = measure_noise(shoot(here, noise), shoot(here, noise), dark, picture_full_scale);
        const Difference difference = compare(shoot(here, noise), shoot(there, noise), dark, model);
        EXPECT_GT(difference.pixels.value, 1.05 + 6 * difference.pixels.sigma) << strength;
    }
}

TEST(Shrinking, KeepsTheMeanAndThePlace) {
    Picture picture{64, 32, std::vector<std::uint16_t>(64 * 32, 10)};
    for (int row = 0; row < 32; ++row)
        for (int column = 32; column < 64; ++column) picture.samples[static_cast<std::size_t>(row * 64 + column)] = 50;
    const Picture small = shrink(picture);
    EXPECT_EQ(mean(small), 30);
    EXPECT_EQ(small.samples.front(), 10);
    EXPECT_EQ(small.samples.back(), 50);
}

TEST(ToPicture, ReadsEightBitColour) {
    Frame frame;
    frame.width = 2;
    frame.height = 1;
    frame.format = PixelFormat::rgb8;
    for (int i = 1; i <= 6; ++i) frame.pixels.push_back(static_cast<std::byte>(i * 40));
    const Picture picture = to_picture(frame);
    EXPECT_EQ(picture.columns, 6);
    EXPECT_THAT(picture.samples, testing::ElementsAre(40, 80, 120, 160, 200, 240));
}

}  // namespace
}  // namespace darkbox
