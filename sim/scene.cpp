#include "sim/scene.h"

#include <limits>

namespace darkbox::sim {
namespace {

constexpr double eye_distance_mm = 1000.0;  // an orthographic ray's start, in front of the object and the ball

Vec3 on_object_plane(const View& view, double u, double v) {
    return {(u - 0.5 * (view.width - 1)) * view.mm_per_pixel, (0.5 * (view.height - 1) - v) * view.mm_per_pixel, 0.0};
}

}  // namespace

Ray camera_ray(const View& view, double u, double v) {
    const Vec3 target = on_object_plane(view, u, v);
    if (view.projection == Projection::orthographic) return {target + Vec3{0, 0, eye_distance_mm}, {0, 0, -1}};
    const Vec3 centre{0, 0, view.distance_mm};
    return {centre, unit(target - centre)};
}

Vec2 project(const View& view, const Vec3& point) {
    const double scale =
        view.projection == Projection::orthographic ? 1.0 : view.distance_mm / (view.distance_mm - point.z);
    return {0.5 * (view.width - 1) + scale * point.x / view.mm_per_pixel,
            0.5 * (view.height - 1) - scale * point.y / view.mm_per_pixel};
}

BallCircle ball_circle(const View& view, const Sphere& sphere) {
    const double flat_radius = sphere.radius_mm / view.mm_per_pixel;
    if (view.projection == Projection::orthographic) return {project(view, sphere.centre), flat_radius};
    const double depth = view.distance_mm - sphere.centre.z;
    const double limb = std::sqrt(depth * depth - sphere.radius_mm * sphere.radius_mm);
    return {project(view, sphere.centre), flat_radius * view.distance_mm / limb};
}

Incidence incidence(const Scene& scene, const SceneLamp& lamp, const Vec3& point) {
    if (scene.lamp_model == LampModel::distant)
        return {direction_at_origin(lamp), std::numeric_limits<double>::infinity(), lamp.power};
    const Vec3 to_lamp = lamp.position - point;
    const double distance = length(to_lamp);
    const double fall_off = reference_distance_mm / distance;
    return {to_lamp / distance, distance, lamp.power * (fall_off * fall_off)};
}

Vec3 direction_at_origin(const SceneLamp& lamp) { return unit(lamp.position); }

}  // namespace darkbox::sim
