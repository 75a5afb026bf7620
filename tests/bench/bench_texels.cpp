#include <benchmark/benchmark.h>

#include <opencv2/core.hpp>

#include "processing/texels/kmeans.h"
#include "processing/texels/texels.h"
#include "tests/support/textured_sphere.h"

namespace darkbox {
namespace {

/// A textured field with grain, as points of a 5x5 RGB neighbourhood or of one colour.
cv::Mat1f points(int dimensions) {
    cv::Mat1f values(40000, dimensions);
    cv::theRNG().state = 17;
    cv::randn(values, 0.0F, 0.05F);
    for (int i = 0; i < values.rows; ++i) values.row(i) += 0.1 * (i % 7);
    return values;
}

void own_kmeans(benchmark::State& state) {
    const cv::Mat1f values = points(static_cast<int>(state.range(0)));
    double inertia = 0;
    for (auto _ : state) inertia = kmeans(values, {16, 30, 1}).inertia;
    state.counters["inertia"] = inertia;
}

void opencv_kmeans(benchmark::State& state) {
    const cv::Mat1f values = points(static_cast<int>(state.range(0)));
    double inertia = 0;
    for (auto _ : state) {
        cv::setRNGSeed(1);
        cv::Mat labels;
        inertia = cv::kmeans(values, 16, labels, {cv::TermCriteria::COUNT, 30, 0}, 1, cv::KMEANS_PP_CENTERS);
    }
    state.counters["inertia"] = inertia;
}

void texels(benchmark::State& state) {
    const AlbedoMap albedo = test::textured_sphere(static_cast<int>(state.range(0)), 1).albedo;
    for (auto _ : state) benchmark::DoNotOptimize(cluster_texels(albedo).index.texels);
}

BENCHMARK(own_kmeans)->Arg(3)->Arg(75)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(opencv_kmeans)->Arg(3)->Arg(75)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(texels)->Arg(256)->Arg(512)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
}  // namespace darkbox
