#include "sim/scenes.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <charconv>
#include <functional>
#include <map>
#include <numbers>
#include <optional>
#include <sstream>
#include <string_view>

#include "acquisition/frame/error.h"
#include "sim/noise.h"
#include "sim/teapot.h"

namespace darkbox::sim {
namespace {

constexpr double field_of_view_mm = 200.0;
constexpr double margin_mm = 4.0;

/// Where objects stand: a little up and to the right, the ball being at the lower left.
constexpr Vec3 object_centre{18, 4, 0};

using Shapes = std::vector<std::variant<Sphere, TriangleMesh>>;

Shapes sphere() { return {Sphere{object_centre, 58.0}}; }

Shapes torus() { return {torus_mesh({object_centre, 42.0, 20.0})}; }

/// The teapot upright, its spout to the right, turned a little and tilted so that the lid is seen.
Shapes teapot() {
    constexpr double tilt = 22.0 * std::numbers::pi / 180.0;
    constexpr double turn = -18.0 * std::numbers::pi / 180.0;
    const auto tilted = [&](const Vec3& p) {
        return Vec3{p.x, p.y * std::cos(tilt) - p.z * std::sin(tilt), p.y * std::sin(tilt) + p.z * std::cos(tilt)};
    };
    const auto in_viewer = [&](const Vec3& p) {  // model: x to the spout, z up
        const Vec3 up{p.x, p.z, -p.y};
        return tilted(
            {up.x * std::cos(turn) + up.z * std::sin(turn), up.y, -up.x * std::sin(turn) + up.z * std::cos(turn)});
    };
    Pose pose{in_viewer({1, 0, 0}), in_viewer({0, 1, 0}), in_viewer({0, 0, 1}), 22.0, {}};
    pose.shift = object_centre - in_viewer({0.22, 0.0, 1.5}) * pose.scale;
    Shapes shapes;
    for (const TriangleMesh& part : teapot_parts()) shapes.emplace_back(posed(part, pose));
    return shapes;
}

/// Rolling ground with an embossed rosette.
Shapes relief() {
    HeightField field;
    field.width_mm = 120.0;
    field.height_mm = 116.0;
    field.height = [](double x, double y) {
        const double r = std::hypot(x, y);
        const double petals = std::cos(6.0 * std::atan2(y, x));
        const double rosette = 7.0 * (1.0 - smooth_step(22.0 + 8.0 * petals, 34.0 + 8.0 * petals, r)) -
                               5.0 * (1.0 - smooth_step(7.0, 16.0, r));
        return rosette + 4.0 * fractal_noise({x / 34.0, y / 34.0, 0.5}, 4, 11);
    };
    TriangleMesh mesh = height_field_mesh(field, 480);
    Pose pose;
    pose.shift = object_centre + Vec3{0, 0, 8};  // clear of the ball's shadow
    return {posed(std::move(mesh), pose)};
}

/// A plane in the object's place, wide enough for the middle of the picture.
Shapes card() {
    HeightField field;
    field.width_mm = 150.0;
    field.height_mm = 130.0;
    field.height = [](double, double) { return 0.0; };
    TriangleMesh mesh = height_field_mesh(field, 8);
    Pose pose;
    pose.shift = object_centre;
    return {posed(std::move(mesh), pose)};
}

const std::map<std::string, std::function<Shapes()>>& shape_makers() {
    static const std::map<std::string, std::function<Shapes()>> makers{
        {"sphere", sphere}, {"torus", torus}, {"teapot", teapot}, {"relief", relief}, {"card", card}};
    return makers;
}

const std::map<std::string, std::function<TexturePtr(std::uint64_t)>>& texture_makers() {
    static const std::map<std::string, std::function<TexturePtr(std::uint64_t)>> makers{
        {"lambert", [](std::uint64_t) { return plain_texture({0.80, 0.74, 0.66}); }},
        {"stone", stone_texture},
        {"moss", moss_texture},
        {"marble", marble_texture},
        {"speckle", speckle_texture},
        {"brick", brick_texture},
        {"weave", weave_texture},
        {"print", print_texture},
        {"melon", melon_texture}};
    return makers;
}

template <class Map>
std::vector<std::string> keys(const Map& map) {
    std::vector<std::string> names;
    for (const auto& [name, maker] : map) names.push_back(name);
    return names;
}

struct SceneName {
    std::string shape;
    std::string texture = "lambert";
    bool near = false;
    bool perspective = false;
    int balls = 1;
    Material material;  // but for its texture
};

[[noreturn]] void throw_unknown(const std::string& name, const std::string& problem) {
    throw InputError(
        fmt::format("unknown simulated scene '{}': {}", name, problem),
        fmt::format("join a shape ({}), a texture ({}) and, if wanted, near, perspective, twoballs, threeballs "
                    "and a material (phong60n30, ggx30, cloth40) by '-', for example brick-torus or teapot-moss-near",
                    fmt::join(keys(shape_makers()), ", "), fmt::join(keys(texture_makers()), ", ")));
}

/// The number that `text` is, and nothing besides, between 1 and `most`.
std::optional<int> whole_number(std::string_view text, int most) {
    int number = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    const bool good = error == std::errc() && end == text.data() + text.size() && number >= 1 && number <= most;
    return good ? std::optional(number) : std::nullopt;
}

/// Whether the word names a material; adds it then.
bool is_material(std::string_view word, Material& material) {
    const auto percent_after = [&](std::string_view kind) -> std::optional<int> {
        return word.starts_with(kind) ? whole_number(word.substr(kind.size()), 100) : std::nullopt;
    };
    if (const auto alpha = percent_after("ggx")) return material.coat_alpha = *alpha / 100.0, true;
    if (const auto sigma = percent_after("cloth")) return material.slope_sigma = *sigma / 100.0, true;
    if (word == "phong") word = "phong25n30";
    const std::size_t n = word.find('n', 5);  // behind "phong"
    if (!word.starts_with("phong") || n == std::string_view::npos) return false;
    const auto strength = whole_number(word.substr(5, n - 5), 100);
    const auto exponent = whole_number(word.substr(n + 1), 1000);
    if (!strength || !exponent) return false;
    material.specular = *strength / 100.0;
    material.exponent = *exponent;
    return true;
}

SceneName parse_scene_name(const std::string& name) {
    SceneName parsed;
    std::istringstream words(name);
    for (std::string word; std::getline(words, word, '-');) {
        if (shape_makers().contains(word))
            parsed.shape = word;
        else if (texture_makers().contains(word))
            parsed.texture = word;
        else if (word == "near")
            parsed.near = true;
        else if (word == "perspective")
            parsed.perspective = true;
        else if (word == "twoballs")
            parsed.balls = 2;
        else if (word == "threeballs")
            parsed.balls = 3;
        else if (!is_material(word, parsed.material))
            throw_unknown(name, fmt::format("'{}' is neither a shape, a texture nor a suffix", word));
    }
    if (parsed.shape.empty()) throw_unknown(name, "it names no shape");
    return parsed;
}

/// Along the left border: in the lower corner, the upper one, and between them.
std::vector<MirrorBall> balls_on_the_left(const View& view, double diameter_mm, int count) {
    const double radius = 0.5 * diameter_mm;
    const double inset = radius + margin_mm;
    const double x = inset - 0.5 * view.width * view.mm_per_pixel;
    const double low = inset - 0.5 * view.height * view.mm_per_pixel;
    std::vector<MirrorBall> balls;
    for (const double y : {low, -low, 0.0}) {
        if (static_cast<int>(balls.size()) == count) break;
        MirrorBall ball;
        ball.sphere = {{x, y, 0.0}, radius};
        balls.push_back(ball);
    }
    return balls;
}

View view_of(const SimDescription& sim, const SceneName& name) {
    View view;
    view.projection = name.perspective ? Projection::perspective : Projection::orthographic;
    view.width = sim.width;
    view.height = sim.height;
    view.mm_per_pixel = field_of_view_mm / sim.width;
    view.distance_mm = sim.camera_distance_mm;
    return view;
}

}  // namespace

Scene scene_by_name(const SimDescription& sim, const std::vector<LampDescription>& lamps, double ball_diameter_mm) {
    const SceneName name = parse_scene_name(sim.scene);
    Scene scene;
    scene.name = sim.scene;
    Material material = name.material;
    material.texture = texture_makers().at(name.texture)(sim.seed);
    for (auto& shape : shape_makers().at(name.shape)()) scene.object.push_back({std::move(shape), material});
    for (const LampDescription& lamp : lamps)
        scene.lamps.push_back({lamp.name, {lamp.position_mm[0], lamp.position_mm[1], lamp.position_mm[2]}});
    scene.lamp_model = name.near ? LampModel::near : LampModel::distant;
    scene.view = view_of(sim, name);
    scene.balls = balls_on_the_left(scene.view, ball_diameter_mm, name.balls);
    return scene;
}

}  // namespace darkbox::sim
