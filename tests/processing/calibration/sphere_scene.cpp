#include "tests/processing/calibration/sphere_scene.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "tests/processing/calibration/ball_scene.h"

namespace darkbox::test {
namespace {

using Eigen::Vector3d;

constexpr double wall_z = -60;
constexpr double far_off = 5000;
constexpr int room_waves = 6;
constexpr double room_detail = 0.8;  ///< radians of phase per radian
constexpr double room_radiance = 0.03;

std::optional<double> distance_to(const SphereScene::Sphere& sphere, const Vector3d& from, const Vector3d& along) {
    const Vector3d off = from - sphere.centre;
    const double b = off.dot(along), c = off.squaredNorm() - sphere.radius * sphere.radius;
    if (b * b < c) return std::nullopt;
    return -b - std::sqrt(b * b - c);
}

}  // namespace

SphereRenderer::SphereRenderer(SphereScene scene) : scene_(std::move(scene)) {
    NormalNumbers random(scene_.room);
    for (int i = 0; i < room_waves; ++i) {
        const Vector3d along(random.next(), random.next(), random.next());
        room_.push_back({room_detail * along, 10 * random.next()});
    }
    const int grid = scene_.rays_per_pixel_side;
    rays_.reserve(static_cast<std::size_t>(scene_.size.area() * grid * grid));
    for (int v = 0; v < scene_.size.height; ++v)
        for (int u = 0; u < scene_.size.width; ++u)
            for (int i = 0; i < grid * grid; ++i)
                rays_.push_back(follow(u + (i % grid + 0.5) / grid - 0.5, v + (i / grid + 0.5) / grid - 0.5));
}

SphereRenderer::Ray SphereRenderer::follow(double u, double v) const {
    const Vector3d target((u - 0.5 * (scene_.size.width - 1)) * scene_.mm_per_pixel,
                          (0.5 * (scene_.size.height - 1) - v) * scene_.mm_per_pixel, 0);
    const bool parallel = std::isinf(scene_.camera_distance);
    const Vector3d eye = parallel ? Vector3d(target + Vector3d(0, 0, far_off)) : Vector3d(0, 0, scene_.camera_distance);
    const Vector3d along = (target - eye).normalized();
    for (const auto& ball : scene_.balls)
        if (const auto t = distance_to(ball, eye, along)) {
            const Vector3d point = eye + *t * along, normal = (point - ball.centre) / ball.radius;
            const Vector3d onward = along - 2 * along.dot(normal) * normal;
            Ray ray = meeting(point, onward);
            ray.mirrored = true;
            ray.from = point;
            return ray;
        }
    return meeting(eye, along);
}

SphereRenderer::Ray SphereRenderer::meeting(const Vector3d& from, const Vector3d& along) const {
    Ray ray;
    ray.along = along;
    const auto t = distance_to(scene_.object, from, along);
    if (t && *t > 0) {
        ray.meets = Ray::Meets::object;
        ray.point = from + *t * along;
        ray.normal = (ray.point - scene_.object.centre) / scene_.object.radius;
    } else if (scene_.wall && along.z() < 0) {
        ray.meets = Ray::Meets::wall;
        ray.point = from + (wall_z - from.z()) / along.z() * along;
    }
    return ray;
}

double SphereRenderer::room(const Vector3d& direction) const {
    double sum = 1;
    for (const Wave& wave : room_) sum += 0.3 * std::sin(wave.along.dot(direction) + wave.phase);
    return room_radiance * std::max(0.0, sum);
}

double SphereRenderer::matt_radiance(const Ray& ray, const Vector3d& lamp) const {
    const Vector3d to_lamp = scene_.near ? (lamp - ray.point).normalized() : lamp;
    const double albedo = ray.meets == Ray::Meets::object ? 0.7 : 0.06;
    return albedo * std::max(0.0, ray.normal.dot(to_lamp));
}

double SphereRenderer::radiance(const Ray& ray, const Vector3d& lamp) const {
    if (!ray.mirrored) return ray.meets == Ray::Meets::room ? room(ray.along) : matt_radiance(ray, lamp);
    const Vector3d to_lamp = scene_.near ? (lamp - ray.from).normalized() : lamp;
    const double reach = scene_.near ? scene_.lamp_radius / (lamp - ray.from).norm() : scene_.lamp_radius;
    // A frosted rim; a sharp one would show the sub-pixels' grid in the highlight's place.
    const double angle = 2 * std::asin(std::min(1.0, 0.5 * (ray.along - to_lamp).norm()));
    const double within = std::clamp((1.25 * reach - angle) / (0.5 * reach), 0.0, 1.0);
    return scene_.lamp_radiance * within +
           (1 - within) * 0.5 * (ray.meets == Ray::Meets::room ? room(ray.along) : matt_radiance(ray, lamp));
}

cv::Mat1f SphereRenderer::render(const Vector3d& lamp) const {
    const int grid = scene_.rays_per_pixel_side;
    // The lens blurs before the pixels gather.
    cv::Mat1f fine(scene_.size * grid);
    auto ray = rays_.begin();
    for (int v = 0; v < scene_.size.height; ++v)
        for (int u = 0; u < scene_.size.width; ++u)
            for (int i = 0; i < grid * grid; ++i)
                fine(v * grid + i / grid, u * grid + i % grid) = static_cast<float>(radiance(*ray++, lamp));
    if (scene_.blur_px > 0) cv::GaussianBlur(fine, fine, {}, grid * scene_.blur_px);
    cv::Mat1f image;
    cv::resize(fine, image, scene_.size, 0, 0, cv::INTER_AREA);
    return image;
}

cv::Mat3f photographed(const cv::Mat1f& radiance, const SensorNoise& noise) {
    cv::Mat3f photograph(radiance.size());
    NormalNumbers random(noise.seed);
    const double levels = (1 << noise.bits) - 1;
    for (int v = 0; v < radiance.rows; ++v)
        for (int u = 0; u < radiance.cols; ++u)
            for (int k = 0; k < 3; ++k) {
                const double electrons = radiance(v, u) * noise.full_well_e;
                const double sigma = std::sqrt(electrons + noise.read_e * noise.read_e);
                const double sample = (electrons + sigma * random.next()) / noise.full_well_e;
                photograph(v, u)[k] = static_cast<float>(std::round(std::clamp(sample, 0.0, 1.0) * levels) / levels);
            }
    return photograph;
}

}  // namespace darkbox::test
