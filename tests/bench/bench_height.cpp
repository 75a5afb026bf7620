#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "processing/normals/integrate.h"
#include "sim/renderer.h"
#include "sim/scenes.h"

namespace darkbox {
namespace {

/// True heights in pixels, the normals that belong to them, and some noise.
struct Truth {
    NormalMap normals;
    cv::Mat1f height;
};

using Surface = std::function<double(double, double)>;  // pixels
using Side = std::function<bool(double, double)>;       // the surface is smooth within each

void add_noise(NormalMap& normals, double sigma) {
    cv::theRNG().state = 7;
    cv::Mat3f noise(normals.normal.size());
    cv::randn(noise, cv::Scalar::all(0), cv::Scalar::all(sigma));
    for (int v = 0; v < noise.rows; ++v)
        for (int u = 0; u < noise.cols; ++u)
            if (normals.valid(v, u)) normals.normal(v, u) = cv::normalize(normals.normal(v, u) + noise(v, u));
}

/// Slopes by differences that stay on the pixel's own side of a step.
double slope(const Surface& z, const Side& side, double u, double v, double du, double dv) {
    const bool ahead = side(u + du, v + dv) == side(u, v), behind = side(u - du, v - dv) == side(u, v);
    const double length = std::hypot(du, dv);
    const double up = ahead ? z(u + du, v + dv) : z(u, v), down = behind ? z(u - du, v - dv) : z(u, v);
    return (up - down) / (length * std::max(1, int(ahead) + int(behind)));
}

Truth truth_of(int size, const Surface& z, const Side& side, const Side& inside) {
    constexpr double h = 1e-3;
    Truth truth{{cv::Mat3f(size, size, cv::Vec3f(0, 0, 0)), cv::Mat1b(size, size, uchar{0})},
                cv::Mat1f(size, size, 0.0F)};
    for (int v = 0; v < size; ++v)
        for (int u = 0; u < size; ++u) {
            if (!inside(u, v)) continue;
            const cv::Vec3d n(-slope(z, side, u, v, h, 0), slope(z, side, u, v, 0, h), 1);
            truth.normals.normal(v, u) = n / cv::norm(n);
            truth.normals.valid(v, u) = 255;
            truth.height(v, u) = static_cast<float>(z(u, v));
        }
    return truth;
}

Truth scene(const std::string& name, int size) {
    const double s = size / 512.0, c = size / 2.0;
    const Side everywhere = [](double, double) { return true; };
    const Side disc = [=](double u, double v) { return std::hypot(u - c, v - c) < 150 * s; };
    if (name == "wave")
        return truth_of(
            size, [=](double u, double v) { return 30 * s * std::sin(u / 60 / s) * std::cos(v / 80 / s); }, everywhere,
            everywhere);
    if (name == "ball")
        return truth_of(
            size,
            [=](double u, double v) {
                const double r = 240 * s;
                return std::sqrt(std::max(1e-9, r * r - (u - c) * (u - c) - (v - c) * (v - c)));
            },
            everywhere, [=](double u, double v) { return std::hypot(u - c, v - c) < 236 * s; });
    if (name == "fold") {  // a half that rises from a line it shares with the flat rest: a step of 0 to 61 pixels
        const Side raised = [=](double u, double v) { return u >= c + 0.25 && v < 0.6 * size; };
        return truth_of(
            size, [=](double u, double v) { return raised(u, v) ? 0.2 * (0.6 * size - v) : 0.0; }, raised, everywhere);
    }
    if (name == "coin")  // half a disc bent up from its diameter
        return truth_of(
            size, [=](double u, double v) { return disc(u, v) ? 0.25 * std::max(0.0, u - c) : 0.0; }, disc, everywhere);
    return truth_of(  // dome: the same, and bulging
        size,
        [=](double u, double v) {
            const double off = (u - c) * (u - c) + (v - c) * (v - c), r = 200 * s, rim = 150 * s;
            if (!disc(u, v)) return 0.0;
            return std::sqrt(r * r - off) - std::sqrt(r * r - rim * rim) + 0.2 * std::max(0.0, u - c);
        },
        disc, everywhere);
}

Truth simulated(const std::string& name, int width) {
    const sim::Scene scene = sim::scene_by_name({.scene = name, .width = width, .height = width * 3 / 4}, {});
    const sim::SceneTruth rendered = sim::render_truth(scene);
    Truth truth{{cv::Mat3f(rendered.normals.height, width), cv::Mat1b(rendered.normals.height, width)},
                cv::Mat1f(rendered.normals.height, width)};
    for (int v = 0; v < truth.height.rows; ++v)
        for (int u = 0; u < width; ++u) {
            const std::size_t i = static_cast<std::size_t>(v * width + u);
            const float* n = rendered.normals.pixel(u, v);
            truth.normals.normal(v, u) = {n[0], n[1], n[2]};
            truth.normals.valid(v, u) = rendered.mask[i] != 0 ? 255 : 0;
            truth.height(v, u) = rendered.heights[i] / static_cast<float>(scene.view.mm_per_pixel);
        }
    return truth;
}

/// RMS about the mean, and median of the absolute difference to the median, pixels.
void count_errors(benchmark::State& state, const Truth& truth, const HeightMap& found) {
    std::vector<double> off;
    double sum = 0, squares = 0;
    for (int v = 0; v < truth.height.rows; ++v)
        for (int u = 0; u < truth.height.cols; ++u)
            if (truth.normals.valid(v, u)) off.push_back(found.height(v, u) - truth.height(v, u));
    for (const double d : off) sum += d, squares += d * d;
    const auto n = static_cast<double>(off.size());
    state.counters["rms_px"] = std::sqrt(std::max(0.0, squares / n - sum / n * (sum / n)));
    const auto middle = off.begin() + static_cast<std::ptrdiff_t>(off.size() / 2);
    std::nth_element(off.begin(), middle, off.end());
    const double median = *middle;
    for (double& d : off) d = std::abs(d - median);
    std::nth_element(off.begin(), middle, off.end());
    state.counters["median_px"] = *middle;
    state.counters["iterations"] = found.iterations;
}

void run(benchmark::State& state, Truth truth, IntegrationMethod method) {
    add_noise(truth.normals, 0.02);
    IntegrationOptions options;
    options.method = method;
    HeightMap found;
    for (auto _ : state) found = integrate_normals({truth.normals}, options);
    count_errors(state, truth, found);
}

const int registered = [] {
    for (const auto& [word, method] : {std::pair("least_squares", IntegrationMethod::least_squares),
                                       std::pair("bilateral", IntegrationMethod::bilateral)}) {
        for (const std::string name : {"wave", "ball", "fold", "coin", "dome"})
            benchmark::RegisterBenchmark(("height/512/" + name + "/" + word).c_str(),
                                         [name, method](auto& state) { run(state, scene(name, 512), method); })
                ->Unit(benchmark::kMillisecond)
                ->UseRealTime()
                ->MeasureProcessCPUTime()
                ->Iterations(1);
        for (const std::string name : {"sphere", "torus", "teapot", "relief"})
            benchmark::RegisterBenchmark(("height/simulated/" + name + "/" + word).c_str(),
                                         [name, method](auto& state) { run(state, simulated(name, 512), method); })
                ->Unit(benchmark::kMillisecond)
                ->UseRealTime()
                ->MeasureProcessCPUTime()
                ->Iterations(1);
        benchmark::RegisterBenchmark((std::string("height/8_megapixels/wave/") + word).c_str(),
                                     [method](auto& state) { run(state, scene("wave", 2828), method); })
            ->Unit(benchmark::kMillisecond)
            ->UseRealTime()
            ->MeasureProcessCPUTime()
            ->Iterations(1);
    }
    return 0;
}();

}  // namespace
}  // namespace darkbox
