#include "sim/sensor.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>

namespace darkbox::sim {
namespace {

RgbImage uniform(double radiance) {
    RgbImage image(256, 256);
    std::fill(image.samples.begin(), image.samples.end(), static_cast<float>(radiance));
    return image;
}

struct Moments {
    double mean = 0.0;
    double variance = 0.0;
};
Moments moments(const std::vector<std::uint16_t>& samples) {
    double sum = 0.0, squares = 0.0;
    for (const double s : samples) sum += s, squares += s * s;
    const double mean = sum / static_cast<double>(samples.size());
    return {mean, squares / static_cast<double>(samples.size()) - mean * mean};
}

TEST(Sensor, MeanAndVarianceFollowThePhotonTransferCurve) {
    const Sensor sensor;
    for (const double gain : {1.0, 2.0})
        for (const double radiance : {0.0, 0.001, 0.02, 0.3, 0.45}) {
            const Moments m = moments(expose(sensor, uniform(radiance), {0.02, gain, 7}));
            const double electrons = radiance / sensor.full_scale_radiance * sensor.full_well_e;
            const double per_electron = gain * (4095 - sensor.black_level) / sensor.full_well_e;
            const double variance =
                per_electron * per_electron * (electrons + sensor.read_noise_e * sensor.read_noise_e) + 1.0 / 12;
            const double samples = 3 * 256 * 256;
            EXPECT_NEAR(m.mean, sensor.black_level + per_electron * electrons, 4 * std::sqrt(variance / samples));
            EXPECT_NEAR(m.variance / variance, 1.0, 4 * std::sqrt(2 / samples) + 0.005) << radiance << ' ' << gain;
        }
}

TEST(Sensor, FewElectronsComeInWholeNumbers) {
    Sensor sensor;
    sensor.bit_depth = 12;
    sensor.black_level = 95;
    sensor.full_well_e = 1000;  // four sample units for each electron
    sensor.read_noise_e = 0;
    const auto samples = expose(sensor, uniform(3.0 / 1000 * sensor.full_scale_radiance), {0.02, 1.0, 1});
    const double none = static_cast<double>(std::count(samples.begin(), samples.end(), 95)) / (3 * 256 * 256);
    EXPECT_NEAR(none, std::exp(-3.0), 0.003);
    for (const int s : samples) ASSERT_EQ((s - 95) % 4, 0);
}

TEST(Sensor, ClipsAtFullScaleAndAtZero) {
    Sensor sensor;
    for (const auto s : expose(sensor, uniform(30.0), {})) ASSERT_EQ(s, 4095);
    sensor.black_level = 0;
    sensor.read_noise_e = 50;
    const auto dark = expose(sensor, uniform(0.0), {});
    EXPECT_GT(std::count(dark.begin(), dark.end(), 0), 3 * 256 * 256 / 3);
}

TEST(Sensor, ASaturatedWellStaysBelowFullScaleAtLowGain) {
    Sensor sensor;
    sensor.read_noise_e = 0;
    for (const auto s : expose(sensor, uniform(30.0), {0.02, 0.5, 0}))
        ASSERT_EQ(s, std::lround(64 + 0.5 * 1.05 * (4095 - 64)));
}

TEST(Sensor, SamplesHaveTheBitDepthAndNoNoiseWhereThereIsNone) {
    for (const int bits : {8, 10, 16}) {
        Sensor sensor;
        sensor.bit_depth = bits;
        sensor.black_level = 4;
        sensor.read_noise_e = 0;
        for (const auto s : expose(sensor, uniform(0.0), {})) ASSERT_EQ(s, 4);
        for (const auto s : expose(sensor, uniform(9.0), {})) ASSERT_EQ(s, (1 << bits) - 1);
    }
}

TEST(Sensor, SignalScalesWithExposureTimesGain) {
    const Sensor sensor;
    const auto signal = [&](double exposure_s, double gain) {
        return moments(expose(sensor, uniform(0.2), {exposure_s, gain, 3})).mean - sensor.black_level;
    };
    const double one = signal(0.02, 1.0);
    EXPECT_NEAR(signal(0.04, 1.0) / one, 2.0, 0.002);
    EXPECT_NEAR(signal(0.01, 1.0) / one, 0.5, 0.002);
    EXPECT_NEAR(signal(0.02, 2.0) / one, 2.0, 0.002);
    EXPECT_NEAR(signal(0.01, 2.0) / one, 1.0, 0.002);
}

TEST(Sensor, NoiseBelongsToTheFrameNotToTheThread) {
    const Sensor sensor;
    const auto samples = [&](std::size_t threads, std::uint64_t frame) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
        return expose(sensor, uniform(0.3), {0.02, 1.0, frame});
    };
    EXPECT_EQ(samples(1, 5), samples(2, 5));
    EXPECT_NE(samples(1, 5), samples(1, 6));
}

}  // namespace
}  // namespace darkbox::sim
