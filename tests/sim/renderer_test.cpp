#include "sim/renderer.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <numbers>
#include <numeric>

#include "tests/sim/sim_test_support.h"

namespace darkbox::sim {
namespace {

/// A white plate in the plane z = 0 that fills the view.
Scene plate_scene(const Vec3& lamp_position, LampModel model) {
    Scene scene;
    HeightField plate{400.0, 400.0, [](double, double) { return 0.0; }};
    scene.object.push_back({height_field_mesh(plate, 40), {plain_texture({0.5, 0.5, 0.5})}});
    scene.lamps.push_back({"lamp", lamp_position});
    scene.lamp_model = model;
    return scene;
}

/// The pixel that shows the point (x, y, 0) of an orthographic view.
const float* at_mm(const Scene& scene, const RgbImage& image, double x, double y) {
    const Vec2 p = project(scene.view, {x, y, 0.0});
    return image.pixel(static_cast<int>(std::lround(p.u)), static_cast<int>(std::lround(p.v)));
}

double mask_area(const SceneTruth& truth) { return std::accumulate(truth.mask.begin(), truth.mask.end(), 0.0); }

TEST(Truth, SphereNormalsAreExact) {
    const Scene scene = scene_of("sphere-lambert", 160, lamps_at({{0, 0, 1}}));
    const auto& sphere = std::get<Sphere>(scene.object.front().shape);
    const SceneTruth truth = render_truth(scene);
    int checked = 0;
    for (int v = 0; v < scene.view.height; ++v)
        for (int u = 0; u < scene.view.width; ++u) {
            const double x = (1.25 * (u - 79.5) - sphere.centre.x) / sphere.radius_mm;  // 1.25 mm per pixel
            const double y = (1.25 * (59.5 - v) - sphere.centre.y) / sphere.radius_mm;
            const double r2 = x * x + y * y;
            ASSERT_EQ(truth.mask[static_cast<std::size_t>(v * 160 + u)], r2 < 1.0 ? 1 : 0) << u << ' ' << v;
            const float* n = truth.normals.pixel(u, v);
            if (r2 > 0.9999) continue;
            ASSERT_NEAR(n[0], x, 1e-6);
            ASSERT_NEAR(n[1], y, 1e-6);
            ASSERT_NEAR(n[2], std::sqrt(1.0 - r2), 1e-6);
            ++checked;
        }
    EXPECT_GT(checked, 6000);
}

TEST(Truth, TorusHasNoHolesAndUnitNormals) {
    const Scene scene = scene_of("torus-lambert", 160, lamps_at({{0, 0, 1}}));
    const SceneTruth truth = render_truth(scene);
    const Torus torus;
    for (int v = 0; v < scene.view.height; ++v)
        for (int u = 0; u < scene.view.width; ++u) {
            const double off_ring =
                std::abs(std::hypot(1.25 * (u - 79.5) - 18.0, 1.25 * (59.5 - v) - 4.0) - torus.ring_mm);
            const bool inside = truth.mask[static_cast<std::size_t>(v * 160 + u)] != 0;
            if (off_ring < torus.tube_mm - 0.01) {
                ASSERT_TRUE(inside) << u << ' ' << v;
                const float* n = truth.normals.pixel(u, v);
                // Squared, because the root magnifies the facets' sag without bound towards the limb.
                ASSERT_NEAR(n[2] * n[2], 1.0 - std::pow(off_ring / torus.tube_mm, 2), 5e-4);
                ASSERT_NEAR(std::hypot(n[0], n[1], n[2]), 1.0, 1e-6);
            }
            if (off_ring > torus.tube_mm + 0.01) {
                ASSERT_FALSE(inside) << u << ' ' << v;
            }
        }
}

TEST(Truth, TeapotStandsUprightWithItsSpoutToTheRight) {
    const Scene scene = scene_of("teapot", 160, lamps_at({{0, 0, 1}}));
    const SceneTruth truth = render_truth(scene);
    int left = 160, right = 0, top = 120, bottom = 0;
    for (int v = 0; v < 120; ++v)
        for (int u = 0; u < 160; ++u)
            if (truth.mask[static_cast<std::size_t>(v * 160 + u)] != 0) {
                left = std::min(left, u), right = std::max(right, u);
                top = std::min(top, v), bottom = std::max(bottom, v);
            }
    EXPECT_GT(right - left, bottom - top);
    const auto mean_row = [&](int from, int to) {
        double sum = 0.0, count = 0.0;
        for (int v = top; v <= bottom; ++v)
            for (int u = from; u <= to; ++u)
                if (truth.mask[static_cast<std::size_t>(v * 160 + u)] != 0) sum += v, count += 1.0;
        return sum / count;
    };
    const double middle = 0.5 * (top + bottom);
    EXPECT_LT(mean_row(right - 6, right), middle - 2) << "the tip of the spout is high";
    bool knob_on_top = false;
    for (int u = left; u <= right; ++u)
        knob_on_top |= truth.mask[static_cast<std::size_t>((top + 1) * 160 + u)] != 0 &&
                       std::abs(u - 0.5 * (left + right)) < 0.15 * (right - left);
    EXPECT_TRUE(knob_on_top);
    bool handle_has_a_hole = false;
    for (int v = top; v <= bottom; ++v) {
        const auto inside = [&](int u) { return truth.mask[static_cast<std::size_t>(v * 160 + u)] != 0; };
        int crossings = 0;
        for (int u = left - 1; u < left + (right - left) / 3; ++u) crossings += !inside(u) && inside(u + 1);
        handle_has_a_hole |= crossings == 2;
    }
    EXPECT_TRUE(handle_has_a_hole);
}

TEST(Renderer, LambertSphereFollowsTheCosine) {
    const std::array<double, 3> direction{0.4, -0.3, 0.8660254037844386};
    const Scene scene = scene_of("sphere-lambert", 320, lamps_at({direction}));
    const auto& sphere = std::get<Sphere>(scene.object.front().shape);
    const RgbImage image = render_radiance(scene, LampId{0});
    const double norm = std::hypot(direction[0], direction[1], direction[2]);
    int checked = 0;
    for (int v = 0; v < 240; ++v)
        for (int u = 0; u < 320; ++u) {
            const double x = (0.625 * (u - 159.5) - sphere.centre.x) / sphere.radius_mm;
            const double y = (0.625 * (119.5 - v) - sphere.centre.y) / sphere.radius_mm;
            if (x * x + y * y > 0.84) continue;  // the mean over a pixel is not its centre's value at the limb
            const double z = std::sqrt(1.0 - x * x - y * y);
            const double cosine = (x * direction[0] + y * direction[1] + z * direction[2]) / norm;
            if (cosine < 0.02) continue;
            ASSERT_NEAR(image.pixel(u, v)[0], 0.80 * cosine, 1e-3) << u << ' ' << v;
            ASSERT_NEAR(image.pixel(u, v)[2], 0.66 * cosine, 1e-3) << u << ' ' << v;
            ++checked;
        }
    EXPECT_GT(checked, 20000);
}

TEST(Renderer, NoLampIsBlack) {
    const RgbImage image = render_radiance(scene_of("sphere-lambert", 64, lamps_at({{0, 0, 1}})), std::nullopt);
    EXPECT_EQ(std::count(image.samples.begin(), image.samples.end(), 0.0F), 64 * 48 * 3);
}

TEST(Renderer, CastShadowLiesWhereTheLampPutsItAndNowhereElse) {
    Scene scene = plate_scene({1000, 0, 1000}, LampModel::distant);
    scene.object.push_back({Sphere{{0, 0, 40}, 10.0}, {plain_texture({0.5, 0.5, 0.5})}});
    const RgbImage image = render_radiance(scene, LampId{0});
    const double lit = 0.5 * std::numbers::sqrt2 / 2;
    int dark = 0;
    for (int v = 0; v < scene.view.height; ++v)
        for (int u = 0; u < scene.view.width; ++u) {
            const double x = 0.5 * (u - 159.5);
            const double y = 0.5 * (119.5 - v);
            if (std::hypot(x, y) < 11.0) continue;  // the sphere hides the plate
            // The shadow of a sphere along (1, 0, 1) on the plane: an ellipse stretched by sqrt 2 along x.
            const double r = std::hypot((x + 40.0) / std::numbers::sqrt2, y);
            if (r < 9.5) {
                ASSERT_EQ(image.pixel(u, v)[1], 0.0F) << x << ' ' << y;
                ++dark;
            }
            if (r > 10.5) {
                ASSERT_NEAR(image.pixel(u, v)[1], lit, 1e-4) << x << ' ' << y;
            }
        }
    EXPECT_GT(dark, 1500);
}

TEST(Renderer, NearLampFallsOffWithTheSquareOfTheDistance) {
    const Vec3 lamp{30, 0, 400};
    const Scene scene = plate_scene(lamp, LampModel::near);
    const RgbImage image = render_radiance(scene, LampId{0});
    for (const double x : {-70.25, -20.25, 30.25, 75.25}) {
        const double distance = std::hypot(x - lamp.x, 0.25, lamp.z);
        const double expected = 0.5 * std::pow(1000.0 / distance, 2) * lamp.z / distance;
        EXPECT_NEAR(at_mm(scene, image, x, 0.25)[0] / expected, 1.0, 1e-4) << x;
    }
}

TEST(Renderer, PhongAddsAHighlightInTheMirrorDirection) {
    const Scene matt = scene_of("sphere-lambert", 320, lamps_at({{0.5, 0.2, 1}}));
    const Scene glossy = scene_of("sphere-lambert-phong", 320, lamps_at({{0.5, 0.2, 1}}));
    const RgbImage a = render_radiance(matt, LampId{0});
    const RgbImage b = render_radiance(glossy, LampId{0});
    int best_u = 0, best_v = 0;
    float most = 0.0F;
    for (int v = 0; v < 240; ++v)
        for (int u = 120; u < 320; ++u)
            if (const float extra = b.pixel(u, v)[0] - a.pixel(u, v)[0]; extra > most)
                most = extra, best_u = u, best_v = v;
    const Vec3 half = unit(unit({0.5, 0.2, 1}) + Vec3{0, 0, 1});
    const auto& sphere = std::get<Sphere>(matt.object.front().shape);
    const Vec2 expected = project(matt.view, sphere.centre + half * sphere.radius_mm);
    EXPECT_NEAR(most, glossy.object.front().material.specular, 2e-3);
    EXPECT_NEAR(best_u, expected.u, 1.0);
    EXPECT_NEAR(best_v, expected.v, 1.0);
}

/// Centroid of the ball's highlight by its radiance.
Vec2 highlight_centroid(const Scene& scene, const RgbImage& image) {
    const BallCircle ball = ball_circle(scene.view, scene.balls.front().sphere);
    double weight = 0.0, u_sum = 0.0, v_sum = 0.0;
    for (int v = 0; v < scene.view.height; ++v)
        for (int u = 0; u < scene.view.width; ++u) {
            const double w = image.pixel(u, v)[0] - 0.2;
            if (w <= 0.0 || std::hypot(u - ball.centre.u, v - ball.centre.v) > ball.radius) continue;
            weight += w, u_sum += w * u, v_sum += w * v;
        }
    return {u_sum / weight, v_sum / weight};
}

TEST(Renderer, BallHighlightLiesAtTheHalfVector) {
    const std::vector<std::array<double, 3>> directions{{0, 0, 1}, {0.6, 0, 0.8}, {-0.5, 0.5, 0.7}, {0.1, -0.8, 0.6}};
    const Scene scene = scene_of("sphere-lambert", 320, lamps_at(directions));
    for (std::uint32_t i = 0; i < directions.size(); ++i) {
        const auto& d = directions[i];
        const Vec3 half = unit(unit({d[0], d[1], d[2]}) + Vec3{0, 0, 1});
        const Vec2 expected =
            project(scene.view, scene.balls.front().sphere.centre + half * scene.balls.front().sphere.radius_mm);
        const Vec2 found = highlight_centroid(scene, render_radiance(scene, LampId{i}));
        EXPECT_NEAR(found.u, expected.u, 0.1) << i;
        EXPECT_NEAR(found.v, expected.v, 0.1) << i;
    }
}

TEST(Renderer, NearLampIsMirroredWhereItStands) {
    const Scene scene = scene_of("sphere-lambert-near", 320, lamps_at({{0.6, 0.3, 0.8}}));
    const Sphere& ball = scene.balls.front().sphere;
    Vec3 on_ball = ball.centre;
    for (int i = 0; i < 20; ++i)
        on_ball = ball.centre + unit(unit(scene.lamps[0].position - on_ball) + Vec3{0, 0, 1}) * ball.radius_mm;
    const Vec2 expected = project(scene.view, on_ball);
    const Vec2 found = highlight_centroid(scene, render_radiance(scene, LampId{0}));
    EXPECT_NEAR(found.u, expected.u, 0.1);
    EXPECT_NEAR(found.v, expected.v, 0.1);
}

TEST(Renderer, HighlightClipsAndTheBallMirrorsTheObjectDimly) {
    // The lamp shines on the side of the object that faces the ball.
    const Scene scene = scene_of("sphere-lambert", 320, lamps_at({{-0.5, -0.2, 0.8}}));
    Scene alone = scene;
    alone.object.clear();
    const RgbImage with = render_radiance(scene, LampId{0});
    const RgbImage without = render_radiance(alone, LampId{0});
    const BallCircle ball = ball_circle(scene.view, scene.balls.front().sphere);
    EXPECT_NEAR(ball.radius, 28.8, 1e-9);
    float brightest = 0.0F, reflected = 0.0F;
    for (int v = 0; v < 240; ++v)
        for (int u = 0; u < 320; ++u) {
            if (std::hypot(u - ball.centre.u, v - ball.centre.v) > ball.radius - 1.0) continue;
            brightest = std::max(brightest, with.pixel(u, v)[0]);
            reflected = std::max(reflected, with.pixel(u, v)[0] - without.pixel(u, v)[0]);
        }
    EXPECT_GT(brightest, 5.0F);
    EXPECT_GT(reflected, 0.02F);
    EXPECT_LT(reflected, 0.15F);
}

TEST(Renderer, PerspectiveShowsWhatIsNearerLarger) {
    Scene scene;
    scene.object.push_back({Sphere{{0, 0, 0}, 30.0}, {plain_texture({1, 1, 1})}});
    const double flat = mask_area(render_truth(scene));
    EXPECT_NEAR(flat, std::numbers::pi * 60 * 60, 40.0);
    scene.view.projection = Projection::perspective;
    scene.view.distance_mm = 200;
    const double limb = 200 * 30 / std::sqrt(200.0 * 200.0 - 30 * 30) / 0.5;
    EXPECT_NEAR(mask_area(render_truth(scene)), std::numbers::pi * limb * limb, 40.0);
    std::get<Sphere>(scene.object.front().shape).centre.z = 50;
    const BallCircle nearer = ball_circle(scene.view, std::get<Sphere>(scene.object.front().shape));
    EXPECT_GT(nearer.radius, 80.0);
    EXPECT_NEAR(mask_area(render_truth(scene)), std::numbers::pi * nearer.radius * nearer.radius, 60.0);
}

TEST(Truth, NormalsAreUnitVectorsUnderReliefOnEveryShape) {
    for (const std::string shape : {"sphere", "torus", "relief", "teapot"}) {
        const SceneTruth truth = render_truth(scene_of(shape + "-brick", 96, lamps_at({{0, 0, 1}})));
        for (std::size_t i = 0; i < truth.mask.size(); ++i) {
            if (!truth.mask[i]) continue;
            const float* n = &truth.normals.samples[3 * i];
            ASSERT_NEAR(n[0] * n[0] + n[1] * n[1] + n[2] * n[2], 1.0F, 1e-5F) << shape << ' ' << i;
        }
    }
}

/// The bricks of a ball are there: without its parameters all of it would be mortar.
TEST(Truth, SphereShowsBricksAndMortar) {
    const SceneTruth truth = render_truth(scene_of("sphere-brick", 160, lamps_at({{0, 0, 1}})));
    int brick = 0, mortar = 0;
    for (std::size_t i = 0; i < truth.mask.size(); ++i) {
        if (!truth.mask[i]) continue;
        const float* albedo = &truth.albedo.samples[3 * i];
        ++(albedo[0] > 1.5F * albedo[2] ? brick : mortar);
    }
    EXPECT_GT(brick, 3 * mortar);
    EXPECT_GT(mortar, 100);
}

TEST(Renderer, SameBitsOnAnyNumberOfThreads) {
    const auto render = [](std::size_t threads) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
        const Scene scene = scene_of("teapot-brick", 96, lamps_at({{0.4, 0.5, 1}}));
        return render_radiance(scene, LampId{0}).samples;
    };
    EXPECT_EQ(render(1), render(2));
}

}  // namespace
}  // namespace darkbox::sim
