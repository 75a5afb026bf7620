#include "sim/quick_sensor.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "sim/lamp_pictures.h"
#include "sim/renderer.h"
#include "tests/sim/sim_test_support.h"

namespace darkbox::sim {
namespace {

constexpr std::size_t quick_samples = 400'000;

std::vector<std::uint16_t> quick(const Sensor& sensor, double radiance, const ExposureSetting& setting) {
    const std::vector<float> light(quick_samples, static_cast<float>(radiance));
    std::vector<std::uint16_t> samples(light.size());
    QuickSensor(sensor.seed).expose(sensor, {{{1.0F, light}}}, setting, samples);
    return samples;
}

struct Spread {
    double mean = 0.0;
    double variance = 0.0;
};
template <typename Values>
Spread spread(const Values& values) {
    double sum = 0.0, squares = 0.0;
    for (const double v : values) sum += v, squares += v * v;
    const double mean = sum / static_cast<double>(values.size());
    return {mean, squares / static_cast<double>(values.size()) - mean * mean};
}

TEST(QuickSensor, MeanAndVarianceFollowThePhotonTransferCurve) {
    Sensor sensor;
    sensor.bit_depth = 16;
    sensor.black_level = 1024;
    for (const double gain : {1.0, 2.0})
        for (const double radiance : {0.0, 0.0005, 0.02, 0.3, 0.45}) {
            const Spread s = spread(quick(sensor, radiance, {0.02, gain, 7}));
            const double electrons = radiance / sensor.full_scale_radiance * sensor.full_well_e;
            const double per_electron = gain * (65535 - sensor.black_level) / sensor.full_well_e;
            const double variance =
                per_electron * per_electron * (electrons + sensor.read_noise_e * sensor.read_noise_e) + 1.0 / 12;
            EXPECT_NEAR(s.mean, sensor.black_level + per_electron * electrons, 4 * std::sqrt(variance / quick_samples))
                << radiance << ' ' << gain;
            EXPECT_NEAR(s.variance / variance, 1.0, 0.01) << radiance << ' ' << gain;
        }
}

TEST(QuickSensor, ClipsAsTheExactOneDoes) {
    Sensor sensor;
    for (const auto s : quick(sensor, 30.0, {})) ASSERT_EQ(s, 4095);
    const Spread half = spread(quick(sensor, 30.0, {0.02, 0.5, 0}));
    EXPECT_NEAR(half.mean, 64 + 0.5 * 1.05 * (4095 - 64), 0.01) << "a saturated well at low gain";
    sensor.black_level = 0;
    sensor.read_noise_e = 50;
    const auto dark = quick(sensor, 0.0, {});
    EXPECT_NEAR(static_cast<double>(std::count(dark.begin(), dark.end(), 0)) / quick_samples, 0.52, 0.02);
}

TEST(QuickSensor, IsBentAsTheExactOneIs) {
    Sensor sensor;
    sensor.nonlinearity = 0.05;
    const std::vector<float> light(quick_samples, 0.4F);
    const Spread exact = spread(expose(sensor, std::span<const float>(light), {}));
    EXPECT_NEAR(spread(quick(sensor, 0.4, {})).mean, exact.mean, 4 * std::sqrt(2 * exact.variance / quick_samples));
}

/// No pattern: neighbours, frames and the sums over blocks, which captures are checked by, know nothing of each other.
TEST(QuickSensor, NoiseIsIndependentFromSampleToSampleAndFromFrameToFrame) {
    const Sensor sensor;
    const auto first = quick(sensor, 0.3, {0.02, 1.0, 1});
    const auto second = quick(sensor, 0.3, {0.02, 1.0, 2});
    const Spread s = spread(first);
    double neighbours = 0.0, frames = 0.0;
    for (std::size_t i = 0; i + 1 < first.size(); ++i) {
        neighbours += (first[i] - s.mean) * (first[i + 1] - s.mean);
        frames += (first[i] - s.mean) * (second[i] - s.mean);
    }
    const double unit = s.variance * static_cast<double>(first.size());
    EXPECT_NEAR(neighbours / unit, 0.0, 0.01);
    EXPECT_NEAR(frames / unit, 0.0, 0.01);

    constexpr std::size_t width = 1920, side = 16;
    std::vector<double> blocks;
    for (std::size_t row = 0; (row + side) * width <= first.size(); row += side)
        for (std::size_t column = 0; column + side <= width; column += side) {
            double sum = 0.0;
            for (std::size_t i = 0; i < side * side; ++i)
                sum += first[(row + i / side) * width + column + i % side] - s.mean;
            blocks.push_back(sum / side);
        }
    const double spread_of_ratio = std::sqrt(2.0 / static_cast<double>(blocks.size()));
    EXPECT_NEAR(spread(blocks).variance / s.variance, 1.0, 4 * spread_of_ratio);
}

TEST(QuickSensor, SameFrameSameSamples) {
    const Sensor sensor;
    EXPECT_EQ(quick(sensor, 0.3, {0.02, 1.0, 5}), quick(sensor, 0.3, {0.02, 1.0, 5}));
    EXPECT_NE(quick(sensor, 0.3, {0.02, 1.0, 5}), quick(sensor, 0.3, {0.02, 1.0, 6}));
    Sensor other;
    other.seed = 2;
    EXPECT_NE(quick(sensor, 0.3, {0.02, 1.0, 5}), quick(other, 0.3, {0.02, 1.0, 5}));
}

TEST(LampPictures, MosaicsAndGreysAreTakenFromTheColours) {
    const auto scene = std::make_shared<const Scene>(scene_of("torus-brick", 64, lamps_at({{0, 0.7, 1}, {0.7, 0, 1}})));
    LampPictures mosaic(scene, SensorColour::rggb), grey(scene, SensorColour::grey), rgb(scene, SensorColour::rgb);
    const RgbImage image = render_radiance(*scene, LampId{1});
    const auto all = rgb.of(LampId{1});
    EXPECT_TRUE(std::equal(all.begin(), all.end(), image.samples.begin(), image.samples.end()));
    for (int v = 0; v < image.height; ++v)
        for (int u = 0; u < image.width; ++u) {
            const float* pixel = image.pixel(u, v);
            const auto i = static_cast<std::size_t>(v * image.width + u);
            ASSERT_EQ(mosaic.of(LampId{1})[i], pixel[v % 2 + u % 2]) << u << ' ' << v;
            ASSERT_FLOAT_EQ(grey.of(LampId{1})[i], (pixel[0] + pixel[1] + pixel[2]) / 3);
        }
    const auto again = sampled(image, SensorColour::rggb);
    const auto seen = mosaic.of(LampId{1});
    EXPECT_TRUE(std::equal(again.begin(), again.end(), seen.begin(), seen.end()));
}

RigDescription quick_rig(bool quick_noise) {
    RigDescription rig = small_rig("torus-lambert");
    rig.sim.width = 160;
    rig.sim.height = 120;
    rig.sim.colour = "rggb";
    rig.sim.bit_depth = 16;
    rig.sim.quick_noise = quick_noise;
    return rig;
}

struct PixelMoments {
    std::vector<double> mean, variance;
};

/// Of `count` frames, all of them exposed as the first is: from a quarter on by another lamp.
PixelMoments frames_of(const RigDescription& description, int count) {
    SimRig rig = SimRig::make(description);
    rig.camera().configure({});
    PixelMoments moments;
    for (int i = 0; i < count; ++i) {
        rig.camera().start();
        rig.lamps().light(LampId{0}, 1.0);
        const TimePoint begin = next(rig).exposure.begin + 2 * to_nanoseconds(Seconds{1.0 / 30});
        rig.clock().sleep_until(begin + Nanoseconds(5'000'000));
        rig.lamps().light(LampId{2}, 0.5);
        next(rig);
        const Frame mixed = next(rig);
        EXPECT_EQ(mixed.format, PixelFormat::rggb16);
        EXPECT_EQ(rig.camera().exposures().back().lamps.size(), 2U);
        EXPECT_NEAR(rig.camera().exposures().back().lamps[0].share, 0.25, 1e-6);
        rig.camera().stop();
        const auto size = static_cast<std::size_t>(mixed.width * mixed.height);
        moments.mean.resize(size);
        moments.variance.resize(size);
        for (std::size_t p = 0; p < size; ++p) {
            const double value = sample(mixed, p);
            moments.mean[p] += value / count;
            moments.variance[p] += value * value / count;
        }
    }
    for (std::size_t p = 0; p < moments.mean.size(); ++p)
        moments.variance[p] = (moments.variance[p] - moments.mean[p] * moments.mean[p]) * count / (count - 1);
    return moments;
}

/// A switch in the midst of the exposure included. The difference of two means over n frames has 2/n of a frame's
/// variance, and its square a spread of sqrt(2) of that.
TEST(SimCamera, QuickFramesAreTheExactOnesButForTheNoiseThatTheyDraw) {
    constexpr int count = 16;
    const PixelMoments exact = frames_of(quick_rig(false), count);
    const PixelMoments quickly = frames_of(quick_rig(true), count);
    double squares = 0.0, exact_variance = 0.0, quick_variance = 0.0, used = 0.0;
    for (std::size_t p = 0; p < exact.mean.size(); ++p) {
        if (exact.mean[p] > 60'000) continue;  // the ball's highlight clips
        const double variance = (exact.variance[p] + quickly.variance[p]) / 2;
        squares += (exact.mean[p] - quickly.mean[p]) * (exact.mean[p] - quickly.mean[p]) / (variance * 2 / count);
        exact_variance += exact.variance[p];
        quick_variance += quickly.variance[p];
        ++used;
    }
    // A variance measured on 2 (n - 1) degrees of freedom makes the ratio f / (f - 2) in the mean.
    constexpr double freedom = 2 * (count - 1);
    EXPECT_NEAR(squares / used, freedom / (freedom - 2), 0.05);
    EXPECT_NEAR(quick_variance / exact_variance, 1.0, 0.01);
}

TEST(SimRig, AnotherOneOfTheSameSceneIsDarkAndCold) {
    SimRig first = SimRig::make(quick_rig(true));
    const auto shot = [](SimRig& rig) {
        rig.camera().configure({});
        rig.camera().start();
        rig.lamps().light(LampId{1}, 1.0);
        next(rig);
        return next(rig).pixels;
    };
    const auto pixels = shot(first);
    SimRig second = SimRig::make_again(first);
    EXPECT_TRUE(second.lamps().all_dark());
    EXPECT_TRUE(second.camera().exposures().empty());
    EXPECT_FALSE(first.lamps().all_dark());
    EXPECT_EQ(shot(second), pixels);
    first = SimRig::make_again(first);
    EXPECT_EQ(shot(first), pixels);
}

}  // namespace
}  // namespace darkbox::sim
