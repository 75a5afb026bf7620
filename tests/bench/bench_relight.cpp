#include <benchmark/benchmark.h>

#include <opencv2/core.hpp>

#include "processing/relight/relight.h"
#include "processing/shading/shading.h"
#include "tests/support/textured_sphere.h"

namespace darkbox {
namespace {

RelightScene scene_of(int side) {
    const test::TexturedSphere s = test::textured_sphere(side, 4);
    return {s.normals, s.albedo, s.index, shading_maps(s.stack, s.lights, s.normals, s.albedo, s.index).maps};
}

/// A new light for every frame.
Light light_of_frame(int frame) { return test::ring_of_lights(10)[frame % 10]; }

void report_frames(benchmark::State& state, double render_seconds) {
    const auto frames = static_cast<double>(state.iterations());
    state.counters["frames_per_second"] = benchmark::Counter(frames, benchmark::Counter::kIsRate);
    state.counters["render_only_ms"] = 1e3 * render_seconds / frames;
}

void one_light(benchmark::State& state) {
    const RelightScene scene = scene_of(static_cast<int>(state.range(0)));
    RelightOptions options;
    options.model = state.range(1) == 0 ? ReflectanceModel::lambert : ReflectanceModel::phong;
    double seconds = 0;
    int frame = 0;
    for (auto _ : state) seconds += relight(scene, {light_of_frame(frame++)}, options).render_seconds;
    report_frames(state, seconds);
}

void environment(benchmark::State& state) {
    const RelightScene scene = scene_of(static_cast<int>(state.range(0)));
    const Environment probe{cv::Mat3f(128, 256, cv::Vec3f(1, 1, 1))};
    double seconds = 0;
    for (auto _ : state) seconds += relight(scene, probe).render_seconds;
    report_frames(state, seconds);
}

/// What one would write first: one thread, one pixel after the other, double precision.
void plain_loop(benchmark::State& state) {
    const RelightScene scene = scene_of(static_cast<int>(state.range(0)));
    const ShadingMaps& maps = scene.shading;
    int frame = 0;
    for (auto _ : state) {
        const Light light = light_of_frame(frame++);
        cv::Mat3f image(scene.index.label.size(), cv::Vec3f(0, 0, 0));
        for (int y = 0; y < image.rows; ++y)
            for (int x = 0; x < image.cols; ++x) {
                const int label = scene.index.label(y, x);
                if (label == 0) continue;
                const double r = std::max(0.0, test::n_dot_l(scene.normals.normal(y, x), light));
                const double position = std::min(r, 1.0) * (maps.levels - 1);
                const int below = std::min(static_cast<int>(position), maps.levels - 2);
                for (int c = 0; c < 3; ++c) {
                    const double low = maps.radiance(label - 1, below)[c];
                    const double high = maps.radiance(label - 1, below + 1)[c];
                    const double detail = scene.albedo.albedo(y, x)[c] / maps.mean_albedo(label - 1, 0)[c];
                    image(y, x)[c] =
                        static_cast<float>((low + (high - low) * (position - below)) * light.intensity[c] * detail);
                }
            }
        benchmark::DoNotOptimize(image.data);
    }
    report_frames(state, 0);
}

BENCHMARK(one_light)->ArgNames({"side", "phong"})->Args({512, 0})->Args({512, 1})->Args({2048, 0})->UseRealTime();
BENCHMARK(environment)->Arg(512)->UseRealTime();
BENCHMARK(plain_loop)->Arg(512)->Arg(2048)->UseRealTime();

}  // namespace
}  // namespace darkbox
