#include "tests/processing/calibration/ball_scene.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

namespace darkbox::test {
namespace {

double room(const Eigen::Vector3d& direction) { return 0.03 + 0.02 * direction.y() + 0.01 * direction.x(); }

double mirrored(const BallScene& scene, double x, double y, const Eigen::Vector3d& light) {
    const double z = std::sqrt(1 - x * x - y * y);
    const Eigen::Vector3d seen(2 * z * x, 2 * z * y, 2 * z * z - 1);
    const bool lamp = seen.dot(light) > std::cos(scene.lamp_radius_deg * std::numbers::pi / 180);
    return lamp ? scene.lamp_radiance : 0.5 * scene.room * room(seen);
}

double diffuse(const BallScene& scene, double x, double y, const Eigen::Vector3d& light) {
    const Eigen::Vector3d normal(x, y, std::sqrt(1 - x * x - y * y));
    const auto check = [&](double t) { return static_cast<int>(std::floor(scene.checks * (t + 1) / 2)); };
    const double albedo = (check(x) + check(y)) % 2 == 0 ? 0.7 : 0.2;
    return albedo * std::max(0.0, normal.dot(light));
}

/// Radiance where a view ray at (u, v) ends.
double radiance(const BallScene& scene, double u, double v, const Eigen::Vector3d& light) {
    const auto seen_on = [&](const Ball& ball) -> std::optional<double> {
        const double x = (u - ball.x) / ball.radius, y = -(v - ball.y) / ball.radius;
        if (x * x + y * y < 1) return mirrored(scene, x, y, light);
        return std::nullopt;
    };
    if (const auto seen = seen_on(scene.ball)) return *seen;
    for (const Ball& ball : scene.more_balls)
        if (const auto seen = seen_on(ball)) return *seen;
    const double object_radius = 0.3 * scene.size.height;
    const double ox = (u - 0.25 * scene.size.width) / object_radius;
    const double oy = -(v - 0.5 * scene.size.height) / object_radius;
    if (ox * ox + oy * oy < 1) return diffuse(scene, ox, oy, light);
    return scene.wall * light.z();
}

}  // namespace

double NormalNumbers::uniform() {
    std::uint64_t z = (state_ += 0x9E3779B97F4A7C15ULL);
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ULL;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBULL;
    z ^= z >> 31;
    return (static_cast<double>(z >> 11) + 0.5) * 0x1.0p-53;
}

double NormalNumbers::next() {
    const double radius = std::sqrt(-2 * std::log(uniform()));
    return radius * std::cos(2 * std::numbers::pi * uniform());
}

std::vector<Eigen::Vector3d> dome_of_lights(int n) {
    std::vector<Eigen::Vector3d> lights;
    for (int i = 0; i < n; ++i) {
        const double slant = (20 + 35.0 * ((i * 7) % n) / n) * std::numbers::pi / 180;
        const double turn = 2.399963 * i;
        lights.emplace_back(std::sin(slant) * std::cos(turn), std::sin(slant) * std::sin(turn), std::cos(slant));
    }
    return lights;
}

std::vector<std::string> frame_names(std::size_t n) {
    std::vector<std::string> names;
    for (std::size_t i = 0; i < n; ++i) names.push_back("frame" + std::to_string(i) + ".tif");
    return names;
}

cv::Mat3f photograph(const BallScene& scene, const Eigen::Vector3d& light) {
    cv::Mat3f image(scene.size);
    const int grid = scene.rays_per_pixel_side;
    NormalNumbers noise(scene.seed ^ static_cast<std::uint64_t>(1e6 * (light.x() + 2 * light.y() + 4)));
    for (int v = 0; v < image.rows; ++v)
        for (int u = 0; u < image.cols; ++u) {
            double sum = 0;
            for (int i = 0; i < grid * grid; ++i)
                sum += radiance(scene, u + (i % grid + 0.5) / grid - 0.5, v + (i / grid + 0.5) / grid - 0.5, light);
            for (int k = 0; k < 3; ++k)
                image(v, u)[k] =
                    static_cast<float>(std::clamp(sum / (grid * grid) + scene.noise * noise.next(), 0.0, 1.0));
        }
    return image;
}

std::vector<cv::Mat3f> photographs(const BallScene& scene, const std::vector<Eigen::Vector3d>& lights) {
    std::vector<cv::Mat3f> frames;
    for (const auto& light : lights) frames.push_back(photograph(scene, light));
    return frames;
}

}  // namespace darkbox::test
