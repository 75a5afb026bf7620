#include "sim/texture.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "sim/noise.h"
#include "sim/random.h"

namespace darkbox::sim {
namespace {

class Plain final : public Texture {
public:
    explicit Plain(const Rgb& albedo) : albedo_(albedo) {}
    Rgb albedo(const SurfacePoint&) const override { return albedo_; }

private:
    Rgb albedo_;
};

/// A point of broken stone.
struct StonePlace {
    StonePlace(const Vec3& p, std::uint64_t seed) {
        const Vec3 bent = p / 11.0 + Vec3{1, 1, 1} * (0.35 * fractal_noise(p / 7.0, 3, seed + 10));
        const Cell grain = cellular_noise(bent, seed + 20);
        id = grain.id;
        inside = smooth_step(0.02, 0.16, grain.second - grain.nearest);
        ochre = smooth_step(-0.35, 0.45, fractal_noise(p / 24.0, 4, seed + 30));
    }

    std::uint64_t id = 0;  ///< of its grain
    double inside = 0.0;   ///< 0 in the joint, 1 on the grain
    double ochre = 0.0;    ///< 0 = grey
};

Rgb stone_colour(const Vec3& p, std::uint64_t seed) {
    const StonePlace place(p, seed);
    const Rgb ground = mix(Rgb{0.52, 0.52, 0.53}, Rgb{0.84, 0.69, 0.48}, place.ochre);
    const double tone = 0.75 + 0.35 * (static_cast<double>(place.id >> 40) * 0x1.0p-24);
    const double dust = 1.0 + 0.12 * fractal_noise(p / 2.5, 2, seed + 40);
    return ground * (tone * dust * (0.45 + 0.55 * place.inside));
}

class Stone final : public Texture {
public:
    explicit Stone(std::uint64_t seed) : seed_(seed) {}
    Rgb albedo(const SurfacePoint& point) const override { return stone_colour(point.position, seed_); }
    int material(const SurfacePoint& point) const override {
        const StonePlace place(point.position, seed_);
        if (place.inside < 0.5) return 0;
        return place.ochre < 0.5 ? 1 : 2;
    }

private:
    std::uint64_t seed_;
};

class Moss final : public Texture {
public:
    explicit Moss(std::uint64_t seed) : seed_(seed) {}
    Rgb albedo(const SurfacePoint& point) const override {
        const Vec3& p = point.position;
        const double lush = 0.5 + 0.5 * fractal_noise(p / 3.2, 3, seed_ + 2);
        const Rgb moss = mix(Rgb{0.10, 0.20, 0.05}, Rgb{0.50, 0.68, 0.20}, std::clamp(lush, 0.0, 1.0));
        return mix(stone_colour(p, seed_ + 3), moss, cover(p));
    }
    int material(const SurfacePoint& point) const override { return cover(point.position) < 0.5 ? 0 : 1; }

private:
    double cover(const Vec3& p) const { return smooth_step(-0.02, 0.16, fractal_noise(p / 17.0, 5, seed_ + 1)); }

    std::uint64_t seed_;
};

class Marble final : public Texture {
public:
    explicit Marble(std::uint64_t seed) : seed_(seed) {}
    Rgb albedo(const SurfacePoint& point) const override {
        const Vec3& p = point.position;
        const double cloud = 0.5 + 0.5 * fractal_noise(p / 14.0, 4, seed_ + 7);
        const Rgb ground = mix(Rgb{0.84, 0.82, 0.78}, Rgb{0.66, 0.68, 0.72}, std::clamp(cloud, 0.0, 1.0));
        return mix(ground, Rgb{0.17, 0.20, 0.27}, 0.85 * vein(p));
    }
    int material(const SurfacePoint& point) const override { return vein(point.position) < 0.5 ? 0 : 1; }

private:
    double vein(const Vec3& p) const {
        const double bend = 3.2 * fractal_noise(p / 26.0, 6, seed_);
        const double wave = std::abs(std::sin(dot(p, Vec3{0.08, 0.14, 0.11}) + bend));
        return 1.0 - smooth_step(0.0, 0.42, wave);
    }

    std::uint64_t seed_;
};

class Speckle final : public Texture {
public:
    explicit Speckle(std::uint64_t seed) : seed_(seed) {}
    Rgb albedo(const SurfacePoint& point) const override {
        Rgb colour = Rgb{0.78, 0.72, 0.60} * (1.0 + 0.05 * fractal_noise(point.position / 9.0, 3, seed_));
        for (const Grain& grain : grains_at(point))
            colour = mix(colour, grain.dark ? Rgb{0.12, 0.09, 0.08} : Rgb{0.58, 0.20, 0.11}, grain.cover);
        return colour;
    }
    int material(const SurfacePoint& point) const override {
        int top = 0;
        for (const Grain& grain : grains_at(point))
            if (grain.cover >= 0.5) top = grain.dark ? 1 : 2;
        return top;
    }

private:
    struct Grain {
        double cover = 0.0;  ///< 0 beside it, 1 on it
        bool dark = false;   ///< else red
    };

    /// The coarse grain nearest to a point, then the fine one, which lies above it.
    std::array<Grain, 2> grains_at(const SurfacePoint& point) const {
        return {grain_at(point.position / 7.5, 1), grain_at(point.position / 3.6, 2)};
    }

    Grain grain_at(const Vec3& p, std::uint64_t layer) const {
        const Cell cell = cellular_noise(p, seed_ + 100 * layer);
        CounterRandom random(cell.id);
        const double radius = 0.16 + 0.26 * random.uniform();
        const double cover = 1.0 - smooth_step(radius - 0.05, radius + 0.05, cell.nearest);
        return {cover, random.uniform() < 0.6};
    }

    std::uint64_t seed_;
};

class Brick final : public Texture {
public:
    explicit Brick(std::uint64_t seed) : seed_(seed) {}

    Rgb albedo(const SurfacePoint& point) const override {
        const Place place = place_of(point);
        CounterRandom random = CounterRandom(seed_).child(place.brick);
        const Rgb fired = mix(Rgb{0.42, 0.13, 0.08}, Rgb{0.74, 0.36, 0.20}, random.uniform());
        const double scorch = 1.0 + 0.30 * fractal_noise(point.position / 4.0, 4, seed_ + 1);
        const double sand = 1.0 + 0.16 * fractal_noise(point.position / 2.0, 2, seed_ + 2);
        return mix(Rgb{0.62, 0.59, 0.53} * sand, fired * scorch, place.inside);
    }

    int material(const SurfacePoint& point) const override { return place_of(point).inside < 0.5 ? 0 : 1; }

    double height_mm(const SurfacePoint& point) const override {
        const Place place = place_of(point);
        return 0.7 * place.inside + 0.10 * fractal_noise(point.position / 3.0, 3, seed_ + 3);
    }
    bool has_relief() const override { return true; }

private:
    struct Place {
        std::uint64_t brick = 0;
        double inside = 0.0;  ///< 0 in the mortar, 1 on the brick
    };

    static Place place_of(const SurfacePoint& point) {
        const double row = std::floor(point.uv.v);
        const double shifted = point.uv.u + 0.5 * std::abs(std::fmod(row, 2.0));
        const double column = std::floor(shifted);
        const double along = 0.5 - std::abs(shifted - column - 0.5);
        const double across = 0.5 - std::abs(point.uv.v - row - 0.5);
        const auto column_id = static_cast<std::uint64_t>(wrapped(std::int64_t(column), point.period_u));
        const auto row_id = static_cast<std::uint64_t>(wrapped(std::int64_t(row), point.period_v));
        // A tile is about twice as long as it is high: the joints are equally wide both ways.
        return {mixed(column_id * 8191 + row_id), smooth_step(0.035, 0.075, along) * smooth_step(0.07, 0.15, across)};
    }

    std::uint64_t seed_;
};

/// How uv changes along a step on the surface: least squares in the plane of the two derivatives.
Vec2 uv_step(const SurfacePoint& point, const Vec3& step) {
    const double uu = dot(point.position_du, point.position_du);
    const double uv = dot(point.position_du, point.position_dv);
    const double vv = dot(point.position_dv, point.position_dv);
    const double determinant = uu * vv - uv * uv;
    // Written so that a surface without parameters, where both sides are zero, ends here as well.
    if (!(determinant > 1e-6 * (uu + vv) * (uu + vv))) return {};
    const double su = dot(step, point.position_du);
    const double sv = dot(step, point.position_dv);
    return {(vv * su - uv * sv) / determinant, (uu * sv - uv * su) / determinant};
}

SurfacePoint moved(SurfacePoint point, const Vec3& step) {
    const Vec2 duv = uv_step(point, step);
    point.position += step;
    point.uv.u += duv.u;
    point.uv.v += duv.v;
    return point;
}

}  // namespace

TexturePtr plain_texture(const Rgb& albedo) { return std::make_shared<Plain>(albedo); }
TexturePtr stone_texture(std::uint64_t seed) { return std::make_shared<Stone>(seed); }
TexturePtr moss_texture(std::uint64_t seed) { return std::make_shared<Moss>(seed); }
TexturePtr marble_texture(std::uint64_t seed) { return std::make_shared<Marble>(seed); }
TexturePtr speckle_texture(std::uint64_t seed) { return std::make_shared<Speckle>(seed); }
TexturePtr brick_texture(std::uint64_t seed) { return std::make_shared<Brick>(seed); }

Vec3 normal_with_relief(const Texture& texture, const SurfacePoint& point, const Vec3& normal) {
    if (!texture.has_relief()) return normal;
    constexpr double step_mm = 0.05;
    const auto slope = [&](const Vec3& t) {
        const double up = texture.height_mm(moved(point, t * step_mm));
        const double down = texture.height_mm(moved(point, t * -step_mm));
        return (up - down) / (2.0 * step_mm);
    };
    const Vec3 t = any_tangent(normal);
    const Vec3 s = cross(normal, t);
    return unit(normal - t * slope(t) - s * slope(s));
}

}  // namespace darkbox::sim
