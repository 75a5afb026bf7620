#include <benchmark/benchmark.h>
#include <tbb/parallel_for.h>

#include <cmath>
#include <cstring>
#include <opencv2/core.hpp>
#include <random>

#include "processing/relight/relighter.h"

namespace darkbox {
namespace {

constexpr int levels = 10;
constexpr int texels = 64;
constexpr double bytes_in = 14, bytes_out = 3;  ///< of a pixel: the compact copy, the picture

/// An object that fills the picture: bumps everywhere, a random texel in each pixel.
RelightScene scene_of(cv::Size size) {
    std::mt19937 random(4);
    std::uniform_real_distribution<float> unit(0.0F, 1.0F);
    RelightScene scene{{cv::Mat3f(size), cv::Mat1b(size, uchar{255})},
                       {cv::Mat3f(size), cv::Mat1b(size, uchar{255})},
                       {cv::Mat1w(size), texels},
                       {texels, levels, cv::Mat3f(texels, levels), cv::Mat1i(texels, levels, 9),
                        cv::Mat3f(texels, 1, cv::Vec3f(0.5F, 0.4F, 0.3F))}};
    for (int y = 0; y < size.height; ++y)
        for (int x = 0; x < size.width; ++x) {
            const double across = 2 * (x + 0.5) / size.width - 1, down = 2 * (y + 0.5) / size.height - 1;
            scene.normals.normal(y, x) =
                cv::normalize(cv::Vec3f(static_cast<float>(across + 0.2 * std::sin(0.4 * x)),
                                        static_cast<float>(-down + 0.2 * std::cos(0.3 * y)), 0.8F));
            scene.albedo.albedo(y, x) = {0.8F * unit(random), 0.7F * unit(random), 0.6F * unit(random)};
            scene.index.label(y, x) = static_cast<std::uint16_t>(1 + random() % texels);
        }
    for (int k = 0; k < texels; ++k)
        for (int i = 0; i < levels; ++i) {
            const float r = static_cast<float>(i) / (levels - 1);
            scene.shading.radiance(k, i) = scene.shading.mean_albedo(k, 0) * (r * (0.8F + 0.4F * unit(random)));
        }
    return scene;
}

/// A new light for every frame.
Light light_of_frame(int frame) {
    Light light;
    light.direction = Eigen::Vector3d(std::cos(0.1 * frame), std::sin(0.1 * frame), 1.2).normalized();
    light.intensity = {1.0, 0.9, 0.8};
    return light;
}

cv::Size size_of(const benchmark::State& state) {
    return {static_cast<int>(state.range(0)), static_cast<int>(state.range(1))};
}

void count(benchmark::State& state, double bytes_per_pixel) {
    const auto frames = static_cast<double>(state.iterations());
    state.counters["frames_per_second"] = benchmark::Counter(frames, benchmark::Counter::kIsRate);
    state.counters["GB_per_second"] =
        benchmark::Counter(1e-9 * frames * size_of(state).area() * bytes_per_pixel, benchmark::Counter::kIsRate);
}

/// The bytes of a frame through all threads and nothing computed: what memory (or the cache, where a frame fits into
/// it) gives. The frames' GB_per_second over this one's is the share of the bandwidth that they reach.
void stream(benchmark::State& state) {
    const cv::Size size = size_of(state);
    const auto words_in = static_cast<int>(size.width * bytes_in / 8),
               words_out = static_cast<int>(size.width * bytes_out / 8);
    const cv::Mat1d in(size.height, words_in, 1.0);
    cv::Mat1d out(size.height, words_out);
    for (auto _ : state) {
        tbb::parallel_for(0, size.height, [&](int y) {
            const double* from = in[y];
            double sums[16] = {};
            for (int i = 0; i + 16 <= words_in; i += 16)
                for (int j = 0; j < 16; ++j) sums[j] += from[i + j];
            benchmark::DoNotOptimize(sums);
            std::memset(out[y], y & 255, sizeof(double) * words_out);
        });
        benchmark::ClobberMemory();
    }
    count(state, bytes_in + bytes_out);
}

/// What one would write first, on all threads: float maps, linear floats out.
void plain_loop(benchmark::State& state) {
    const cv::Size size = size_of(state);
    const RelightScene scene = scene_of(size);
    const ShadingMaps& maps = scene.shading;
    cv::Mat3f image(size);
    int frame = 0;
    for (auto _ : state) {
        const Light light = light_of_frame(frame++);
        const cv::Vec3f direction(cv::Vec3d(light.direction[0], light.direction[1], light.direction[2]));
        const cv::Vec3f intensity(cv::Vec3d(light.intensity[0], light.intensity[1], light.intensity[2]));
        tbb::parallel_for(0, size.height, [&](int y) {
            for (int x = 0; x < size.width; ++x) {
                const float r = std::min(std::max(0.0F, scene.normals.normal(y, x).dot(direction)), 1.0F);
                const float position = r * (levels - 1);
                const int below = std::min(static_cast<int>(position), levels - 2);
                const cv::Vec3f* level = maps.radiance[scene.index.label(y, x) - 1] + below;
                image(y, x) =
                    (level[0] + (level[1] - level[0]) * (position - static_cast<float>(below))).mul(intensity);
            }
        });
        benchmark::ClobberMemory();
    }
    count(state, 26);
}

RelightOptions options_of(ReflectanceModel model) {
    RelightOptions options;
    options.model = model;
    return options;
}

void bytes_one_light(benchmark::State& state, ReflectanceModel model, Encoding encoding) {
    const Relighter relighter(scene_of(size_of(state)));
    const RelightOptions options = options_of(model);
    cv::Mat3b image(relighter.size());
    int frame = 0;
    for (auto _ : state) relighter.render({light_of_frame(frame++)}, options, encoding, image);
    count(state, bytes_in + bytes_out);
}

void floats_one_light(benchmark::State& state) {
    const Relighter relighter(scene_of(size_of(state)));
    cv::Mat3f image(relighter.size());
    int frame = 0;
    for (auto _ : state) relighter.render({light_of_frame(frame++)}, {}, image);
    count(state, 40);
}

void bytes_near_lamp(benchmark::State& state, ReflectanceModel model) {
    RelightScene scene = scene_of(size_of(state));
    scene.geometry.view = ViewGeometry{0.1, {0.5 * size_of(state).width, 0.5 * size_of(state).height}, 500};
    scene.geometry.height_mm = cv::Mat1f(size_of(state), 3.0F);
    const Relighter relighter(scene);
    const RelightOptions options = options_of(model);
    cv::Mat3b image(relighter.size());
    int frame = 0;
    for (auto _ : state) {
        Light lamp = light_of_frame(frame++);
        lamp.near = LampPosition{150 * lamp.direction};
        relighter.render({lamp}, options, Encoding::srgb, image);
    }
    count(state, bytes_in + bytes_out + 4);
}

Environment sky() {
    Environment probe{cv::Mat3f(128, 256)};
    for (int y = 0; y < 128; ++y)
        for (int x = 0; x < 256; ++x)
            probe.radiance(y, x) = {1.0F - 0.005F * static_cast<float>(y), 0.8F, 0.5F + 0.001F * static_cast<float>(x)};
    return probe;
}

void bytes_environment(benchmark::State& state, ReflectanceModel model) {
    const Relighter relighter(scene_of(size_of(state)));
    const RelightOptions options = options_of(model);
    const FoldedEnvironment folded = relighter.fold(sky(), options);
    cv::Mat3b image(relighter.size());
    for (auto _ : state) relighter.render(folded, options, Encoding::srgb, image);
    count(state, bytes_in + bytes_out);
}

void fold(benchmark::State& state, ReflectanceModel model) {
    const Relighter relighter(scene_of({64, 64}));
    for (auto _ : state) benchmark::DoNotOptimize(relighter.fold(sky(), options_of(model)));
}

void sizes(benchmark::internal::Benchmark* bench) {
    bench->ArgNames({"width", "height"})->Args({512, 512})->Args({3840, 2160})->MeasureProcessCPUTime()->UseRealTime();
}

BENCHMARK(stream)->Apply(sizes);
BENCHMARK(plain_loop)->Apply(sizes);
BENCHMARK_CAPTURE(bytes_one_light, lambert, ReflectanceModel::lambert, Encoding::srgb)->Apply(sizes);
BENCHMARK_CAPTURE(bytes_one_light, lambert_linear, ReflectanceModel::lambert, Encoding::linear)->Apply(sizes);
BENCHMARK_CAPTURE(bytes_one_light, phong, ReflectanceModel::phong, Encoding::srgb)->Apply(sizes);
BENCHMARK_CAPTURE(bytes_one_light, phong_split, ReflectanceModel::phong_split, Encoding::srgb)->Apply(sizes);
BENCHMARK_CAPTURE(bytes_near_lamp, lambert, ReflectanceModel::lambert)->Apply(sizes);
BENCHMARK_CAPTURE(bytes_near_lamp, phong, ReflectanceModel::phong)->Apply(sizes);
BENCHMARK_CAPTURE(bytes_environment, lambert, ReflectanceModel::lambert)->Apply(sizes);
BENCHMARK_CAPTURE(bytes_environment, phong_split, ReflectanceModel::phong_split)->Apply(sizes);
BENCHMARK(floats_one_light)->Apply(sizes);
BENCHMARK_CAPTURE(fold, lambert, ReflectanceModel::lambert)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK_CAPTURE(fold, phong, ReflectanceModel::phong)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
}  // namespace darkbox
