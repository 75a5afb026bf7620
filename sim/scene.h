#pragma once

#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "sim/geometry.h"
#include "sim/mesh.h"
#include "sim/texture.h"

namespace darkbox::sim {

/// A matt body with the texture's albedo, and gloss over it. Without any of the numbers Lambert's law; with specular
/// alone the radiance under a lamp of irradiance 1 is albedo (n . l) + specular (r . v)^exponent. reflectance.h has the
/// formulas.
struct Material {
    TexturePtr texture;
    double specular = 0.0;  ///< Phong's strength
    double exponent = 30.0;
    double coat_alpha = 0.0;   ///< width of a GGX coat's highlight; 0: no coat
    double slope_sigma = 0.0;  ///< of Oren and Nayar's facets, radians; 0: Lambert
};

struct Sphere {
    Vec3 centre;
    double radius_mm = 50.0;
};

struct Surface {
    std::variant<Sphere, TriangleMesh> shape;
    Material material;
};

/// A polished black ball: an ideal mirror of low reflectance over a faint matt body.
struct MirrorBall {
    Sphere sphere;
    double reflectance = 0.08;
    Rgb body{0.03, 0.03, 0.03};
};

enum class LampModel {
    distant,  ///< the same direction and irradiance everywhere
    near,     ///< 1/d^2 from the lamp's position, irradiance 1 at reference_distance_mm
};
constexpr double reference_distance_mm = 1000.0;

/// A frosted lamp; irradiance 1 means that a white matt surface facing it has radiance 1.
struct SceneLamp {
    std::string name;
    Vec3 position;            ///< mm; distant lamps shine along it
    double radius_mm = 60.0;  ///< of the glowing ball that mirrors show
    Rgb power{1, 1, 1};
};

enum class Projection { orthographic, perspective };

/// The camera looks along -z; the optical axis goes through the viewer frame's origin and the picture's centre.
struct View {
    Projection projection = Projection::orthographic;
    int width = 320;             ///< pixels
    int height = 240;            ///< pixels
    double mm_per_pixel = 0.5;   ///< in the plane z = 0
    double distance_mm = 800.0;  ///< of a perspective camera's centre from the origin
};

/// The ray through pixel coordinates (u, v), starting in front of everything.
Ray camera_ray(const View& view, double u, double v);
/// Where a point appears, in pixel coordinates.
Vec2 project(const View& view, const Vec3& point);

/// The outline of a sphere, in pixels: exact for orthographic cameras; for perspective ones the circle about the
/// projected centre whose radius is that of the limb's cone, the ellipse's stretch left out.
struct BallCircle {
    Vec2 centre;
    double radius = 0.0;
};
BallCircle ball_circle(const View& view, const Sphere& sphere);

/// The dark box: a backdrop behind the object and five walls far away. It receives light and shadows, throws none.
struct Box {
    double half_width_mm = 1200.0;
    double backdrop_z_mm = -90.0;
    double front_z_mm = 1500.0;
    Rgb backdrop{0.005, 0.005, 0.005};
    Rgb walls{0.05, 0.05, 0.05};
};

/// All that the simulated camera can see. Plain data.
struct Scene {
    std::string name;
    std::vector<Surface> object;
    std::vector<MirrorBall> balls;
    std::vector<SceneLamp> lamps;
    LampModel lamp_model = LampModel::distant;
    View view;
    Box box;
};

/// Light of one lamp at one point.
struct Incidence {
    Vec3 direction;          ///< unit, from the point to the lamp
    double distance_mm = 0;  ///< infinite for distant lamps
    Rgb irradiance;          ///< on a surface facing the lamp
};
Incidence incidence(const Scene& scene, const SceneLamp& lamp, const Vec3& point);

/// The unit vector from the origin to the lamp: what light calibration should find.
Vec3 direction_at_origin(const SceneLamp& lamp);

}  // namespace darkbox::sim
