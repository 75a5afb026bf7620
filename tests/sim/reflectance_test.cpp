#include "sim/reflectance.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <variant>

#include "sim/renderer.h"
#include "sim/truth.h"
#include "tests/sim/sim_test_support.h"

namespace darkbox::sim {
namespace {

constexpr Vec3 up{0, 0, 1};

Vec3 direction(double slant_deg, double turn_deg) {
    const double s = slant_deg * std::numbers::pi / 180, t = turn_deg * std::numbers::pi / 180;
    return {std::sin(s) * std::cos(t), std::sin(s) * std::sin(t), std::cos(s)};
}

using Law = std::function<double(const Vec3& l, const Vec3& v)>;

/// The share of the light from `l` that returns into the hemisphere: the mean of the law over directions by cosine.
double returned(const Law& law, const Vec3& l) {
    constexpr int rings = 400, sectors = 360;
    double sum = 0;
    for (int i = 0; i < rings; ++i) {
        const double squared_sine = (i + 0.5) / rings;
        for (int j = 0; j < sectors; ++j) {
            const double turn = 2 * std::numbers::pi * (j + 0.5) / sectors, sine = std::sqrt(squared_sine);
            sum += law(l, {sine * std::cos(turn), sine * std::sin(turn), std::sqrt(1 - squared_sine)});
        }
    }
    return sum / (rings * sectors);
}

TEST(Reflectance, GgxAndOrenNayarAreReciprocal) {
    for (const double slant : {5.0, 40.0, 75.0})
        for (const double turn : {0.0, 70.0, 180.0}) {
            const Vec3 l = direction(slant, 20), v = direction(50, 20 + turn);
            EXPECT_NEAR(ggx(up, l, v, 0.3), ggx(up, v, l, 0.3), 1e-12);
            EXPECT_NEAR(coat_transmission(up, l, v), coat_transmission(up, v, l), 1e-12);
            EXPECT_NEAR(oren_nayar(up, l, v, 0.4), oren_nayar(up, v, l, 0.4), 1e-12);
        }
}

TEST(Reflectance, NoLawReturnsMoreThanCame) {
    for (const double slant : {0.0, 30.0, 60.0, 80.0}) {
        const Vec3 l = direction(slant, 0);
        for (const double alpha : {0.1, 0.3, 0.6}) {
            const auto coated = [=](const Vec3& from, const Vec3& to) {
                return ggx(up, from, to, alpha) + coat_transmission(up, from, to);
            };
            EXPECT_LE(returned(coated, l), 1.0) << alpha << ' ' << slant;
            EXPECT_GT(returned(coated, l), 0.25);
        }
        const auto cloth = [](const Vec3& from, const Vec3& to) { return oren_nayar(up, from, to, 0.4); };
        EXPECT_LE(returned(cloth, l), 1.01) << slant;
    }
}

TEST(Reflectance, GgxAtItsPeakIsThePapersFormula) {
    const double alpha = 0.25;
    // At n = l = v all cosines are 1 and both masking terms too: D F / 4, times pi.
    EXPECT_NEAR(ggx(up, up, up, alpha), 0.04 / (4 * alpha * alpha), 1e-12);
}

TEST(Reflectance, GgxReturnsWhatFresnelSaysWhenItIsSharp) {
    const auto coat = [](const Vec3& from, const Vec3& to) { return ggx(up, from, to, 0.15); };
    EXPECT_NEAR(returned(coat, up), 0.04, 0.003);
}

TEST(Reflectance, OrenNayarsLimits) {
    const Vec3 l = direction(60, 0), v = direction(60, 180), beside = direction(60, 90);
    EXPECT_NEAR(oren_nayar(up, l, beside, 0.0), 1.0, 1e-12);
    EXPECT_GT(oren_nayar(up, l, l, 0.4), 1.2 * oren_nayar(up, l, v, 0.4));  // rough matter sends light back
    EXPECT_NEAR(oren_nayar(up, l, v, 0.4), 1 - 0.5 * 0.16 / 0.49, 1e-12);
}

/// The sphere's radiance at a pixel against a formula, where a pixel's mean is its centre's value.
void expect_sphere(const std::string& name, const Law& law, double tolerance) {
    const Vec3 lamp{0.5, 0.2, 1};
    const Scene scene = scene_of(name, 320, lamps_at({{lamp.x, lamp.y, lamp.z}}));
    const RgbImage image = render_radiance(scene, LampId{0});
    const auto& sphere = std::get<Sphere>(scene.object.front().shape);
    int checked = 0;
    for (int v = 0; v < 240; v += 3)
        for (int u = 0; u < 320; u += 3) {
            const Ray ray = camera_ray(scene.view, u, v);
            const Vec3 at = (ray.origin - sphere.centre) / sphere.radius_mm;
            const double flat = at.x * at.x + at.y * at.y;
            if (flat > 0.7) continue;
            const Vec3 n{at.x, at.y, std::sqrt(1 - flat)};
            if (dot(n, unit(lamp)) < 0.1) continue;
            // Turned so that the law, written for n = up, sees the same angles.
            const double cosine = dot(n, unit(lamp));
            const Vec3 tangent = any_tangent(n), other = cross(n, tangent);
            const auto turned = [&](const Vec3& d) { return Vec3{dot(d, tangent), dot(d, other), dot(d, n)}; };
            ASSERT_NEAR(image.pixel(u, v)[1], law(turned(unit(lamp)), turned(up)) * cosine, tolerance)
                << name << ' ' << u << ' ' << v;
            ++checked;
        }
    EXPECT_GT(checked, 1000);
}

TEST(Reflectance, ScenesFollowTheFormulas) {
    constexpr double green = 0.74;
    expect_sphere(
        "sphere-phong60n10",
        [](const Vec3& l, const Vec3& v) {
            const Vec3 r{-l.x, -l.y, l.z};
            return green + 0.60 * std::pow(std::max(0.0, dot(r, v)), 10) / l.z;
        },
        2e-3);
    expect_sphere(
        "sphere-cloth40", [](const Vec3& l, const Vec3& v) { return green * oren_nayar(up, l, v, 0.4); }, 2e-3);
    expect_sphere(
        "sphere-ggx40",
        [](const Vec3& l, const Vec3& v) { return green * coat_transmission(up, l, v) + ggx(up, l, v, 0.4); }, 3e-3);
}

TEST(Reflectance, MaterialWordsNeedTheirNumbers) {
    for (const std::string name : {"sphere-phong30", "sphere-phongn10", "sphere-phong0n10", "sphere-phong30n10x",
                                   "sphere-ggx", "sphere-ggx0", "sphere-ggx101", "sphere-cloth-1"})
        EXPECT_ANY_THROW(scene_of(name, 64, lamps_at({{0, 0, 1}}))) << name;
    EXPECT_EQ(scene_of("torus-phong", 64, lamps_at({{0, 0, 1}})).object.front().material.exponent, 30.0);
}

}  // namespace
}  // namespace darkbox::sim
