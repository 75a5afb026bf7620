#pragma once

#include <Eigen/Geometry>
#include <array>
#include <opencv2/core.hpp>

#include "processing/calibration/mirror.h"

namespace darkbox {

// What refine() minimises, for Ceres' automatic derivatives. Parameter blocks: a sphere is (x, y, z, radius) in mm, a
// lamp its direction or its position, the rig's pose a turn (angle times axis) and a shift. Residuals are in standard
// deviations.

/// Distance of a contour point to the outline, across it: how far the view ray passes by the sphere, less its radius,
/// over what a pixel's step changes that distance. Exact on the outline, for circle and ellipse alike.
struct ContourResidual {
    ContourResidual(const ViewGeometry& view, const cv::Point2d& at, double sigma)
        : viewing(view), origin(view.point_at(at)), towards(view.to_camera(origin)), sigma_px(sigma) {}
    Viewing viewing;
    Eigen::Vector3d origin, towards;  ///< of the view ray
    double sigma_px;

    template <class T>
    bool operator()(const T* sphere, T* residual) const {
        const Vector3<T> from_origin{sphere[0] - origin[0], sphere[1] - origin[1], sphere[2] - origin[2]};
        const T along = from_origin.dot(towards.cast<T>());
        const Vector3<T> off = from_origin - along * towards.cast<T>();  // from the ray to the centre
        const T passes = Viewing::sqrt_of(off.squaredNorm());
        const T z = origin[2] + along * towards[2];
        const T in_plane = Viewing::sqrt_of(T(off[0] * off[0] + off[1] * off[1]));
        const T per_pixel = viewing.mm_per_pixel * viewing.spread(z) * in_plane / passes;
        residual[0] = (passes - sphere[3]) / (per_pixel * sigma_px);
        return true;
    }
};

/// The same where the whole contour may be off: shifted and widened by three numbers in standard deviations.
struct ShiftedContourResidual {
    ContourResidual contour;
    Eigen::Vector3d by_shift;  ///< how far out each of the three moves the point, in its standard deviations

    template <class T>
    bool operator()(const T* sphere, const T* shift, T* residual) const {
        contour(sphere, residual);
        for (int i = 0; i < 3; ++i) residual[0] -= by_shift[i] * shift[i];
        return true;
    }
};

/// A highlight's place, corrected for the lamp's size, against where the sphere mirrors the lamp's middle.
struct HighlightResidual {
    Viewing viewing;
    double u, v, sigma_px;
    bool near = false;

    template <class T>
    bool operator()(const T* sphere, const T* lamp, T* residual) const {
        const Vector3<T> centre{sphere[0], sphere[1], sphere[2]};
        const Vector3<T> source{lamp[0], lamp[1], lamp[2]};
        const Vector3<T> distant = unit_of(source);
        const auto to_lamp = [&](const Vector3<T>& point) {
            return near ? unit_of<T>(Vector3<T>(source - point)) : distant;
        };
        const Vector3<T> normal = mirror_normal(viewing, centre, sphere[3], to_lamp);
        const Vector2<T> seen = viewing.project<T>(Vector3<T>(centre + sphere[3] * normal));
        residual[0] = (seen[0] - u) / sigma_px;
        residual[1] = (seen[1] - v) / sigma_px;
        return true;
    }
};

/// What is believed of a sphere's depth and size beforehand.
struct SpherePrior {
    double z, z_sigma, radius, radius_sigma;

    template <class T>
    bool operator()(const T* sphere, T* residual) const {
        residual[0] = (sphere[2] - z) / z_sigma;
        residual[1] = (sphere[3] - radius) / radius_sigma;
        return true;
    }
};

/// A circle believed beforehand: its centre and radius in pixels, against the outline's.
struct OutlinePrior {
    Viewing viewing;
    double x, y, radius, sigma_px;

    template <class T>
    bool operator()(const T* sphere, T* residual) const {
        const OutlineOf<T> outline =
            outline_of_sphere<T>(viewing, Vector3<T>(sphere[0], sphere[1], sphere[2]), sphere[3]);
        residual[0] = (outline.x - x) / sigma_px;
        residual[1] = (outline.y - y) / sigma_px;
        residual[2] = (Viewing::sqrt_of(T(outline.along * outline.across)) - radius) / sigma_px;
        return true;
    }
};

/// A lamp's place against the description's, which the rig's pose carries into the viewer frame. A distant lamp's
/// direction against the direction to that place, in mm there.
struct NominalResidual {
    Eigen::Vector3d in_rig;
    double slack_mm;
    bool near = false;

    template <class T>
    bool operator()(const T* turn, const T* shift, const T* lamp, T* residual) const {
        const Vector3<T> place = placed(turn, shift);
        const T scale = near ? T(1.0) : Viewing::sqrt_of(place.squaredNorm());
        for (int i = 0; i < 3; ++i) residual[i] = (scale * lamp[i] - place[i]) / slack_mm;
        return true;
    }

    template <class T>
    Vector3<T> placed(const T* turn, const T* shift) const {
        const Vector3<T> axis{turn[0], turn[1], turn[2]};
        const Vector3<T> p = in_rig.cast<T>();
        const T squared = axis.squaredNorm();
        Vector3<T> turned = p + axis.cross(p);  // Rodrigues, to first order where the angle vanishes
        if (squared > T(1e-24)) {
            using std::cos;
            using std::sin;
            const T angle = Viewing::sqrt_of(squared);
            const Vector3<T> k = axis / angle;
            turned = p * cos(angle) + k.cross(p) * sin(angle) + k * (k.dot(p) * (1.0 - cos(angle)));
        }
        return turned + Vector3<T>(shift[0], shift[1], shift[2]);
    }
};

/// Three numbers believed to be these.
struct VectorPrior {
    std::array<double, 3> value;
    double sigma;

    template <class T>
    bool operator()(const T* x, T* residual) const {
        for (std::size_t i = 0; i < 3; ++i) residual[i] = (x[i] - value[i]) / sigma;
        return true;
    }
};

/// One number believed to be this.
struct NumberPrior {
    double value, sigma;

    template <class T>
    bool operator()(const T* x, T* residual) const {
        residual[0] = (x[0] - value) / sigma;
        return true;
    }
};

/// A near lamp's distance from a point, believed roughly: without this a single ball leaves it open.
struct DistancePrior {
    Eigen::Vector3d from;
    double distance, sigma;

    template <class T>
    bool operator()(const T* lamp, T* residual) const {
        const Vector3<T> off{lamp[0] - from[0], lamp[1] - from[1], lamp[2] - from[2]};
        residual[0] = (Viewing::sqrt_of(off.squaredNorm()) - distance) / sigma;
        return true;
    }
};

}  // namespace darkbox
