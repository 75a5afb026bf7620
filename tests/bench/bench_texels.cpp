#include <benchmark/benchmark.h>

#include <numeric>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "processing/texels/kmeans.h"
#include "processing/texels/neighbourhood.h"
#include "processing/texels/texels.h"
#include "tests/support/textured_sphere.h"

namespace darkbox {
namespace {

constexpr int seeds = 10;

/// 512 x 512 pixels of blotches in three colours with fine grain.
AlbedoMap blotches() {
    cv::RNG random(17);
    const auto noise = [&](double sigma) {
        cv::Mat1f field(512, 512);
        random.fill(field, cv::RNG::NORMAL, 0, 1);
        cv::GaussianBlur(field, field, {}, sigma);
        cv::Mat mean, deviation;
        cv::meanStdDev(field, mean, deviation);
        return cv::Mat1f(field / deviation.at<double>(0));
    };
    const cv::Mat1f coarse = noise(9);
    const cv::Mat1f middle = noise(4);
    AlbedoMap map{cv::Mat3f(512, 512), cv::Mat1b(512, 512, std::uint8_t{255})};
    const cv::Vec3f colour[3] = {{0.35F, 0.28F, 0.2F}, {0.2F, 0.3F, 0.12F}, {0.6F, 0.57F, 0.5F}};
    for (int y = 0; y < 512; ++y)
        for (int x = 0; x < 512; ++x) {
            const int kind = coarse(y, x) > 0.6F ? 2 : (middle(y, x) > 0 ? 1 : 0);
            const auto grain = static_cast<float>(random.gaussian(0.03));
            map.albedo(y, x) = colour[kind] * (1 + 0.2F * middle(y, x)) + cv::Vec3f(grain, grain, grain);
        }
    return map;
}

/// 262144 points of the dimensions asked for: colours, 5 x 5 neighbourhoods, or (negative) noise without structure.
cv::Mat1f points(std::int64_t kind) {
    if (kind < 0) {
        cv::Mat1f values(512 * 512, static_cast<int>(-kind));
        cv::RNG(5).fill(values, cv::RNG::NORMAL, 0, 1);
        return values;
    }
    const AlbedoMap map = blotches();
    std::vector<cv::Point> pixels;
    for (int i = 0; i < 512 * 512; ++i) pixels.emplace_back(i % 512, i / 512);
    const Neighbourhoods source(map, pixels, kind == 3 ? 1 : 5);
    std::vector<int> all(pixels.size());
    std::iota(all.begin(), all.end(), 0);
    cv::Mat1f values(source.count(), source.dimensions());
    source.read(all, values[0]);
    return values;
}

void own_kmeans(benchmark::State& state) {
    const cv::Mat1f values = points(state.range(0));
    double inertia = 0;
    std::uint64_t seed = 0;
    for (auto _ : state)
        inertia += kmeans(MatrixPoints(values), {static_cast<int>(state.range(1)), 30, ++seed}).inertia;
    state.counters["inertia"] = inertia / seeds;
}

void opencv_kmeans(benchmark::State& state) {
    const cv::Mat1f values = points(state.range(0));
    double inertia = 0;
    int seed = 0;
    for (auto _ : state) {
        cv::setRNGSeed(++seed);
        cv::Mat labels;
        inertia += cv::kmeans(values, static_cast<int>(state.range(1)), labels, {cv::TermCriteria::COUNT, 30, 0}, 1,
                              cv::KMEANS_PP_CENTERS);
    }
    state.counters["inertia"] = inertia / seeds;
}

void texels(benchmark::State& state) {
    const AlbedoMap albedo = test::textured_sphere(static_cast<int>(state.range(0)), 1).albedo;
    for (auto _ : state) benchmark::DoNotOptimize(cluster_texels(albedo).index.texels);
}

void both_tables(benchmark::internal::Benchmark* bench) {
    for (const std::int64_t kind : {3, 75, -75})
        for (const std::int64_t clusters : {16, 64}) bench->Args({kind, clusters});
    bench->Iterations(seeds)->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime()->UseRealTime();
}

BENCHMARK(own_kmeans)->Apply(both_tables);
BENCHMARK(opencv_kmeans)->Apply(both_tables);
BENCHMARK(texels)->Arg(256)->Arg(512)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
}  // namespace darkbox
