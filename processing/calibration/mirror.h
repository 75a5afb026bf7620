#pragma once

#include <Eigen/Core>
#include <cmath>

#include "processing/maps/view.h"

namespace darkbox {

// The geometry of a mirror ball, for doubles and for Ceres' dual numbers alike: what refine() differentiates and what
// reflect.h computes is one and the same formula. Viewer frame, mm; pixels u right, v down.

template <class T>
using Vector3 = Eigen::Matrix<T, 3, 1>;
template <class T>
using Vector2 = Eigen::Matrix<T, 2, 1>;

/// ViewGeometry in the form in which an orthographic camera is nothing special: one over the distance is 0.
struct Viewing {
    explicit Viewing(const ViewGeometry& view)
        : mm_per_pixel(view.mm_per_pixel), principal(view.principal), nearness(1 / view.distance_mm) {}
    double mm_per_pixel;
    cv::Point2d principal;
    double nearness;  ///< one over the camera's distance from the origin, 1/mm

    /// How much smaller a pixel is at this height than in the plane z = 0.
    template <class T>
    T spread(const T& z_mm) const {
        return 1.0 - nearness * z_mm;
    }
    template <class T>
    Vector2<T> project(const Vector3<T>& point) const {
        const T scale = mm_per_pixel * spread(point[2]);
        return {principal.x + point[0] / scale, principal.y - point[1] / scale};  // v runs down, y up
    }
    /// Unit vector from a point to the camera.
    template <class T>
    Vector3<T> to_camera(const Vector3<T>& point) const {
        const Vector3<T> towards{-nearness * point[0], -nearness * point[1], spread(point[2])};
        return towards / sqrt_of(towards.squaredNorm());
    }

    template <class T>
    static T sqrt_of(const T& value) {
        using std::sqrt;
        return sqrt(value);
    }
};

template <class T>
Vector3<T> unit_of(const Vector3<T>& vector) {
    return vector / Viewing::sqrt_of(vector.squaredNorm());
}

/// A ball's outline in pixels: the tangent cone's section with the picture, an ellipse whose long axis points to the
/// principal point; a circle when orthographic.
template <class T>
struct OutlineOf {
    T x, y;
    T along;   ///< half axis towards the principal point
    T across;  ///< the other half axis, never the longer one
};
template <class T>
OutlineOf<T> outline_of_sphere(const Viewing& view, const Vector3<T>& centre, const T& radius) {
    const T w = view.spread(centre[2]), kr = view.nearness * radius;
    const T kx = view.nearness * centre[0], ky = view.nearness * centre[1];
    const T square = w * w - kr * kr;
    const T shift = w / (square * view.mm_per_pixel);
    return {view.principal.x + centre[0] * shift, view.principal.y - centre[1] * shift,
            radius * Viewing::sqrt_of(T(square + kx * kx + ky * ky)) / (square * view.mm_per_pixel),
            radius / (Viewing::sqrt_of(square) * view.mm_per_pixel)};
}

/// The ball's normal where `to_lamp(point)`, the unit vector from a point to the lamp, is mirrored into the camera:
/// halfway between the directions to the lamp and to the camera, both seen from that very point. For a near lamp or a
/// perspective camera this is Alhazen's problem; turning the normal halfway again and again settles it, the faster the
/// smaller the ball is beside the distances. Dual numbers settle with the values.
template <class T, class ToLamp>
Vector3<T> mirror_normal(const Viewing& view, const Vector3<T>& centre, const T& radius, const ToLamp& to_lamp) {
    constexpr int most_turns = 200;
    constexpr double settled = 1e-28;  // squared; one more turn then carries the derivatives home
    const auto halfway = [&](const Vector3<T>& point) {
        return unit_of<T>(Vector3<T>(to_lamp(point) + view.to_camera(point)));
    };
    const auto value = [](const Vector3<T>& v) {
        if constexpr (std::is_same_v<T, double>)
            return v;
        else
            return Vector3<double>(v[0].a, v[1].a, v[2].a);
    };
    Vector3<T> normal = halfway(centre);
    bool last = false;
    for (int turn = 0; turn < most_turns; ++turn) {
        const Vector3<T> next = halfway(Vector3<T>(centre + radius * normal));
        const double moved = (value(next) - value(normal)).squaredNorm();
        normal = next;
        if (last) break;
        last = moved < settled;
    }
    return normal;
}

}  // namespace darkbox
