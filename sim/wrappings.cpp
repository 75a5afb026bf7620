// What balls are covered with: cloths, and a melon's rind.

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sim/noise.h"
#include "sim/random.h"
#include "sim/texture.h"

namespace darkbox::sim {
namespace {

/// A cell of a grid over uv that closes where the surface does.
struct GridCell {
    std::int64_t column = 0;
    std::int64_t row = 0;
    double u = 0.0;  ///< from its middle, -0.5...0.5
    double v = 0.0;
};

/// `size`: of a cell, in tiles; the surface's period has to be a multiple of it.
GridCell grid_cell(const SurfacePoint& point, const Vec2& size) {
    const double u = point.uv.u / size.u;
    const double v = point.uv.v / size.v;
    const double column = std::floor(u);
    const double row = std::floor(v);
    return {wrapped(std::int64_t(column), int(point.period_u / size.u)),
            wrapped(std::int64_t(row), int(point.period_v / size.v)), u - column - 0.5, v - row - 0.5};
}

/// Plain weave: warp threads, along v, and weft threads, along u, lie on top by turns.
class Weave final : public Texture {
public:
    explicit Weave(std::uint64_t seed) : seed_(seed) {}

    Rgb albedo(const SurfacePoint& point) const override {
        const Thread thread = thread_at(point);
        CounterRandom random = CounterRandom(seed_).child(2 * thread.number + (thread.warp ? 1 : 0));
        const double dye = 0.92 + 0.16 * random.uniform();
        const double fibres = 1.0 + 0.12 * fractal_noise(point.position / 2.4, 3, seed_ + 1);
        const Rgb colour = thread.warp ? Rgb{0.50, 0.17, 0.13} : Rgb{0.90, 0.81, 0.64};
        return colour * (dye * fibres * (0.45 + 0.55 * thread.height));
    }
    int material(const SurfacePoint& point) const override { return thread_at(point).warp ? 0 : 1; }
    double height_mm(const SurfacePoint& point) const override { return 0.45 * thread_at(point).height; }
    bool has_relief() const override { return true; }

private:
    struct Thread {
        bool warp = false;
        std::uint64_t number = 0;
        double height = 0.0;  ///< 1 on top of its bow, 0 in the holes of the cloth
    };

    /// A thread is a round ridge that bows up over one neighbour and down under the next.
    static double height_of_thread(double across, double along, bool on_top) {
        const double bow = (on_top ? 0.5 : -0.5) * std::cos(std::numbers::pi * along);
        return (bow + 1.0 - 4.0 * across * across) / 1.5;
    }

    static Thread thread_at(const SurfacePoint& point) {
        const GridCell cell = grid_cell(point, {0.25, 0.5});
        const bool warp_on_top = (cell.column + cell.row) % 2 == 0;
        const double warp = height_of_thread(cell.u, cell.v, warp_on_top);
        const double weft = height_of_thread(cell.v, cell.u, !warp_on_top);
        if (warp > weft) return {true, static_cast<std::uint64_t>(cell.column), warp};
        return {false, static_cast<std::uint64_t>(cell.row), std::max(weft, 0.0)};
    }

    std::uint64_t seed_;
};

class Print final : public Texture {
public:
    explicit Print(std::uint64_t seed) : seed_(seed) {}

    Rgb albedo(const SurfacePoint& point) const override {
        const Flower flower = flower_at(point);
        const double threads = 1.0 + 0.10 * fractal_noise(point.position / 1.6, 2, seed_ + 1);
        const Rgb ground{0.20, 0.33, 0.50};
        const Rgb petal = mix(Rgb{0.88, 0.82, 0.72}, Rgb{0.80, 0.42, 0.36}, flower.blush);
        return mix(mix(ground, petal, flower.petal), Rgb{0.74, 0.53, 0.12}, flower.heart) * threads;
    }
    int material(const SurfacePoint& point) const override {
        const Flower flower = flower_at(point);
        if (flower.heart >= 0.5) return 2;
        return flower.petal >= 0.5 ? 1 : 0;
    }
    /// Soft creases.
    double height_mm(const SurfacePoint& point) const override {
        return 0.9 * std::abs(fractal_noise(point.position / 21.0, 3, seed_ + 2));
    }
    bool has_relief() const override { return true; }

private:
    struct Flower {
        double petal = 0.0;  ///< 1 on the flower
        double heart = 0.0;  ///< 1 on its middle
        double blush = 0.0;  ///< 0...1, of the flower
    };

    Flower flower_at(const SurfacePoint& point) const {
        const GridCell cell = grid_cell(point, {1.0, 2.0});
        CounterRandom random = CounterRandom(seed_).child(
            mixed(static_cast<std::uint64_t>(cell.column) * 8191 + static_cast<std::uint64_t>(cell.row)));
        const double size = 0.30 + 0.12 * random.uniform();
        const double u = cell.u - (1.0 - 2.0 * size) * (random.uniform() - 0.5);
        const double v = cell.v - (1.0 - 2.0 * size) * (random.uniform() - 0.5);
        const double turn = 2.0 * std::numbers::pi * random.uniform();
        const double r = std::hypot(u, v) / size;
        const double edge = 0.78 + 0.22 * std::cos(5.0 * std::atan2(v, u) + turn);
        return {1.0 - smooth_step(edge - 0.07, edge + 0.07, r), 1.0 - smooth_step(0.22, 0.32, r), random.uniform()};
    }

    std::uint64_t seed_;
};

class Melon final : public Texture {
public:
    explicit Melon(std::uint64_t seed) : seed_(seed) {}

    Rgb albedo(const SurfacePoint& point) const override {
        const Vec3& p = point.position;
        const double ripe = smooth_step(-0.4, 0.5, fractal_noise(p / 30.0, 4, seed_ + 1));
        const double mottle = 1.0 + 0.22 * fractal_noise(p / 3.0, 3, seed_ + 2);
        const double cork = 1.0 + 0.12 * fractal_noise(p / 1.8, 2, seed_ + 3);
        const Rgb rind = mix(Rgb{0.24, 0.31, 0.12}, Rgb{0.56, 0.41, 0.14}, ripe);
        return mix(rind * mottle, Rgb{0.76, 0.69, 0.53} * cork, net(p));
    }
    int material(const SurfacePoint& point) const override { return net(point.position) < 0.5 ? 0 : 1; }
    double height_mm(const SurfacePoint& point) const override {
        const Vec3& p = point.position;
        return 0.55 * net(p) + 0.06 * fractal_noise(p / 2.2, 2, seed_ + 4);
    }
    bool has_relief() const override { return true; }

private:
    /// 1 on the cork: along the borders of cells, drawn wider and narrower, with thinner threads between.
    double net(const Vec3& p) const {
        const Vec3 wander = p + Vec3{1, -1, 1} * (2.2 * fractal_noise(p / 6.0, 2, seed_ + 5));
        const double width = 0.10 + 0.04 * fractal_noise(p / 12.0, 2, seed_ + 6);
        const double coarse = border(wander / 9.0, width, seed_ + 7);
        const double between = 0.7 * smooth_step(-0.1, 0.3, fractal_noise(p / 16.0, 2, seed_ + 9));
        if (coarse >= between) return coarse;
        return std::max(coarse, between * border(wander / 4.5, 0.6 * width, seed_ + 8));
    }

    static double border(const Vec3& p, double width, std::uint64_t seed) {
        const Cell cell = cellular_noise(p, seed);
        return 1.0 - smooth_step(0.5 * width, 1.5 * width, cell.second - cell.nearest);
    }

    std::uint64_t seed_;
};

}  // namespace

TexturePtr weave_texture(std::uint64_t seed) { return std::make_shared<Weave>(seed); }
TexturePtr print_texture(std::uint64_t seed) { return std::make_shared<Print>(seed); }
TexturePtr melon_texture(std::uint64_t seed) { return std::make_shared<Melon>(seed); }

}  // namespace darkbox::sim
