#include <benchmark/benchmark.h>
#include <malloc.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <limits>
#include <numbers>
#include <numeric>
#include <vector>

#include "processing/maps/photo_source.h"
#include "processing/normals/photometric_stereo.h"

namespace darkbox {
namespace {

constexpr int photographs = 16;
const cv::Size eight_megapixels(3264, 2448);

/// Lamps on a spiral from the camera's axis down to 50 degrees from it.
Lights spiral(int count) {
    Lights lights(static_cast<std::size_t>(count));
    for (int i = 0; i < count; ++i) {
        const double slant = 50 * std::numbers::pi / 180 * std::sqrt((i + 0.5) / count), turn = 2.4 * i;
        lights[static_cast<std::size_t>(i)].direction = {std::sin(slant) * std::cos(turn),
                                                         std::sin(slant) * std::sin(turn), std::cos(slant)};
    }
    return lights;
}

/// A textured field of bumps under one light, as a sensor of the sample's width sees it.
template <class Sample>
cv::Mat photograph(cv::Size size, const Light& light, double full_scale) {
    using Pixel = cv::Vec<Sample, 3>;
    cv::Mat_<Pixel> image(size);
    const auto l = light.direction.cast<float>();
    tbb::parallel_for(0, size.height, [&](int y) {
        for (int x = 0; x < size.width; ++x) {
            const float u = static_cast<float>(x) * 0.02F, v = static_cast<float>(y) * 0.02F;
            const Eigen::Vector3f n = Eigen::Vector3f(0.5F * std::sin(u), 0.5F * std::sin(v), 1.0F).normalized();
            const float shade = std::max(0.0F, n.dot(l)) * static_cast<float>(full_scale);
            const float texture = 0.5F + 0.3F * std::sin(7 * u) * std::sin(5 * v);
            image(y, x) =
                Pixel(cv::saturate_cast<Sample>(0.9F * texture * shade),
                      cv::saturate_cast<Sample>(0.7F * texture * shade), cv::saturate_cast<Sample>(0.5F * shade));
        }
    });
    return image;
}

std::vector<PhotoRows> photographs_of(const Lights& lights, cv::Size size, int depth) {
    std::vector<PhotoRows> photos;
    for (const Light& light : lights) {
        const double full = depth == CV_8U ? 255 : depth == CV_16U ? 65535 : 1;
        PhotoRows photo;
        photo.samples = depth == CV_8U    ? photograph<uchar>(size, light, full)
                        : depth == CV_16U ? photograph<ushort>(size, light, full)
                                          : photograph<float>(size, light, full);
        photo.scale = static_cast<float>(1 / full);
        if (depth != CV_32F) photo.limit = static_cast<float>(full);
        photos.push_back(photo);
    }
    return photos;
}

/// The sum of all words, on all threads: nothing that reads the samples can be faster.
std::uint64_t sum_of_words(const std::vector<PhotoRows>& photos) {
    std::vector<std::uint64_t> sums(static_cast<std::size_t>(photos.front().samples.rows));
    tbb::parallel_for(std::size_t{0}, sums.size(), [&](std::size_t row) {
        for (const PhotoRows& photo : photos) {
            const auto* words = photo.samples.ptr<std::uint64_t>(static_cast<int>(row));
            const std::size_t count = static_cast<std::size_t>(photo.samples.cols) * photo.samples.elemSize() / 8;
            sums[row] += std::accumulate(words, words + count, std::uint64_t{0});
        }
    });
    return std::accumulate(sums.begin(), sums.end(), std::uint64_t{0});
}

/// The best of several runs. Processor time is what other programs on the machine disturb least.
struct Best {
    double wall = std::numeric_limits<double>::infinity();
    double cpu = std::numeric_limits<double>::infinity();

    template <class Work>
    void of(Work work) {
        const auto start = std::chrono::steady_clock::now();
        const std::clock_t cpu_start = std::clock();
        benchmark::DoNotOptimize(work());
        cpu = std::min(cpu, static_cast<double>(std::clock() - cpu_start) / CLOCKS_PER_SEC);
        wall = std::min(wall, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
    }
};

/// The solver alone, samples and maps in memory, beside the time it takes to read the same samples. The maps come to
/// lie where those of the run before did: clearing pages for a program is the system's work, not the solver's. The
/// argument is the samples' OpenCV depth.
void least_squares(benchmark::State& state) {
    const Lights lights = spiral(photographs);
    const auto photos = photographs_of(lights, eight_megapixels, static_cast<int>(state.range(0)));
    const cv::Mat1b mask(eight_megapixels, uchar{255});
    mallopt(M_MMAP_MAX, 0);
    mallopt(M_TRIM_THRESHOLD, std::numeric_limits<int>::max());
    Best solving, reading;
    for (auto _ : state) {
        solving.of([&] {
            PhotosInMemory source(photos, {}, mask);
            return photometric_stereo(source, lights).pixels;
        });
        reading.of([&] { return sum_of_words(photos); });
    }
    state.counters["solve_ms"] = 1e3 * solving.wall;
    state.counters["read_ms"] = 1e3 * reading.wall;
    state.counters["ratio"] = solving.wall / reading.wall;
    state.counters["solve_cpu_ms"] = 1e3 * solving.cpu;
    state.counters["read_cpu_ms"] = 1e3 * reading.cpu;
    state.counters["cpu_ratio"] = solving.cpu / reading.cpu;
}

BENCHMARK(least_squares)
    ->ArgNames({"depth"})
    ->Arg(CV_8U)
    ->Arg(CV_16U)
    ->Arg(CV_32F)
    ->Iterations(7)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

}  // namespace
}  // namespace darkbox
