// How well photometric stereo does on materials: prints tables. Not a timing loop but a table of errors; seconds stand
// beside real photographs only. $DARKBOX_DATA adds diligent_ball.

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "processing/formats/map_files.h"
#include "processing/formats/picture.h"
#include "processing/normals/photometric_stereo.h"
#include "tests/support/simulated_stack.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

struct Errors {
    double mean = 0, median = 0, p95 = 0;
};

/// Over all of the mask; a pixel without a normal is 90 degrees off.
Errors errors_of(const PhotometricStereoResult& result, const cv::Mat3f& truth, const cv::Mat1b& mask) {
    std::vector<double> angles;
    double sum = 0;
    for (int y = 0; y < mask.rows; ++y)
        for (int x = 0; x < mask.cols; ++x) {
            if (!mask(y, x)) continue;
            const cv::Vec3f &n = result.normals.normal(y, x), &t = truth(y, x);
            angles.push_back(result.normals.valid(y, x) ? angle_deg({n[0], n[1], n[2]}, {t[0], t[1], t[2]}) : 90.0);
            sum += angles.back();
        }
    std::sort(angles.begin(), angles.end());
    return {sum / static_cast<double>(angles.size()), angles[angles.size() / 2], angles[angles.size() * 95 / 100]};
}

PhotometricStereoResult solve(const PhotoStack& stack, const Lights& lights, Solver solver) {
    PhotometricStereoOptions options;
    options.solver = solver;
    return photometric_stereo(stack, lights, options);
}

double cpu_seconds() {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    const auto seconds = [](const timeval& t) {
        return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
    };
    return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

void print_row(const std::string& name, const PhotoStack& stack, const Lights& lights, const cv::Mat3f& truth) {
    const Errors plain = errors_of(solve(stack, lights, Solver::lsq), truth, stack.mask);
    const auto result = solve(stack, lights, Solver::robust);
    const Errors robust = errors_of(result, truth, stack.mask);
    fmt::print("{:28} lsq {:6.3f} {:6.3f} {:6.2f}   robust {:6.3f} {:6.3f} {:6.2f}   ratio {:.3f}   {}, gloss {}\n",
               name, plain.mean, plain.median, plain.p95, robust.mean, robust.median, robust.p95,
               robust.mean / plain.mean, result.model.law.name(), result.model.gloss.name());
    std::fflush(stdout);
}

void diligent_ball() {
    const char* data = std::getenv("DARKBOX_DATA");
    const fs::path folder = data ? fs::path(data) / "diligent_ball" : fs::path();
    if (folder.empty() || !fs::exists(folder)) return fmt::print("diligent_ball: set DARKBOX_DATA\n");
    const double cpu = cpu_seconds();
    const auto start = std::chrono::steady_clock::now();
    PhotoStack stack;
    stack.mask = cv::imread((folder / "mask.png").string(), cv::IMREAD_GRAYSCALE) > 127;
    Lights lights;
    std::ifstream directions(folder / "light_directions.txt"), intensities(folder / "light_intensities.txt");
    for (int i = 1; i <= 96; ++i) {
        const Picture picture = read_picture(folder / fmt::format("{:03}.png", i));
        stack.images.push_back(picture.samples);
        stack.clipped.push_back(clipped_samples(picture));
        Light light;
        light.file = fmt::format("{:03}.png", i);
        stack.files.push_back(light.file);
        for (int c = 0; c < 3; ++c) directions >> light.direction[c];
        for (int c = 0; c < 3; ++c) intensities >> light.intensity[c];
        lights.push_back(light);
    }
    solve(stack, lights, Solver::robust);
    const double wall = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    fmt::print("diligent_ball, decoding and robust: {:.2f} s wall, {:.2f} s CPU\n", wall, cpu_seconds() - cpu);
    print_row("diligent_ball", stack, lights, read_normal_truth(folder / "Normal_gt.mat").normal);
}

void simulated(const std::string& scene, int lamps) {
    const test::SimulatedStack shot = test::simulated_stack(scene, lamps, 96);
    print_row(fmt::format("{}, {} lights", scene, lamps), shot.stack, shot.lights, shot.normals);
}

void print_tables() {
    fmt::print("degrees: mean, median, 95th percentile\n");
    diligent_ball();
    fmt::print("\nLambert, then Phong's highlights\n");
    for (const char* shape : {"sphere", "torus"}) simulated(shape, 24);
    for (const char* shape : {"sphere", "torus", "relief", "teapot"})
        for (const char* material :
             {"phong30n10", "phong30n30", "phong30n100", "phong60n10", "phong60n30", "phong60n100"})
            simulated(fmt::format("{}-{}", shape, material), 24);
    fmt::print("\nmaterials and shapes that no setting was chosen on\n");
    for (const char* shape : {"sphere", "torus", "relief", "teapot"})
        for (const char* material : {"marble-ggx15", "brick-ggx30", "speckle-ggx30", "moss-ggx50", "lambert-cloth15",
                                     "stone-cloth30", "speckle-cloth50", "marble-phong40n60"})
            simulated(fmt::format("{}-{}", shape, material), 24);
    for (const int lamps : {9, 12, 48}) simulated("torus-speckle-ggx30", lamps);
}

}  // namespace
}  // namespace darkbox

int main() { darkbox::print_tables(); }
