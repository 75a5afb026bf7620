#include "sim/scenes.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "acquisition/frame/error.h"
#include "sim/renderer.h"
#include "sim/sensor.h"
#include "tests/sim/sim_test_support.h"

namespace darkbox::sim {
namespace {

/// Whether the pixel and all its neighbours are within the mask: no ray meets the backdrop.
bool shows_nothing_but_the_object(const SceneTruth& truth, int u, int v) {
    const int width = truth.normals.width;
    if (u < 1 || v < 1 || u > width - 2 || v > truth.normals.height - 2) return false;
    for (int dv = -1; dv <= 1; ++dv)
        for (int du = -1; du <= 1; ++du)
            if (truth.mask[static_cast<std::size_t>((v + dv) * width + u + du)] == 0) return false;
    return true;
}

TEST(Scenes, UnknownNamesListTheKnownOnes) {
    for (const std::string name : {"teacup-moss", "brick", "torus-bricks", "", "torus--x"}) {
        try {
            scene_of(name, 64, lamps_at({{0, 0, 1}}));
            FAIL() << name;
        } catch (const InputError& e) {
            EXPECT_NE(std::string(e.what()).find("'" + name + "'"), std::string::npos) << e.what();
            for (const char* known : {"relief", "sphere", "teapot", "torus", "brick", "marble", "moss", "speckle"})
                EXPECT_NE(e.hint().find(known), std::string::npos) << e.hint();
        }
    }
}

TEST(Scenes, BallStaysInViewApartFromTheObject) {
    for (const std::string shape : {"sphere", "torus", "teapot", "relief", "card"})
        for (const int width : {64, 320}) {
            const Scene scene = scene_of(shape + "-lambert", width, lamps_at({{0, 0, 1}}));
            const SceneTruth truth = render_truth(scene);
            const BallCircle ball = ball_circle(scene.view, scene.balls.front().sphere);
            EXPECT_GE(ball.centre.u - ball.radius, 0.0);
            EXPECT_LE(ball.centre.v + ball.radius, scene.view.height - 1.0);
            EXPECT_GE(ball.radius, 24.0 * width / 320);
            for (int v = 0; v < scene.view.height; ++v)
                for (int u = 0; u < scene.view.width; ++u)
                    if (truth.mask[static_cast<std::size_t>(v * width + u)] != 0) {
                        ASSERT_GT(std::hypot(u - ball.centre.u, v - ball.centre.v), ball.radius) << shape;
                    }
        }
}

TEST(Scenes, SeveralBallsStandApartAndInView) {
    for (const std::string shape : {"sphere", "torus", "teapot", "relief"}) {
        EXPECT_EQ(scene_of(shape + "-twoballs", 320, lamps_at({{0, 0, 1}})).balls.size(), 2U);
        const Scene scene = scene_of(shape + "-perspective-threeballs", 96, lamps_at({{0, 0, 1}}));
        ASSERT_EQ(scene.balls.size(), 3U);
        const SceneTruth truth = render_truth(scene);
        for (std::size_t i = 0; i < 3; ++i) {
            const BallCircle ball = ball_circle(scene.view, scene.balls[i].sphere);
            EXPECT_GE(ball.centre.u - ball.radius, 0.0);
            EXPECT_GE(ball.centre.v - ball.radius, 0.0);
            EXPECT_LE(ball.centre.v + ball.radius, scene.view.height - 1.0);
            for (std::size_t j = 0; j < i; ++j)
                EXPECT_GT(length(scene.balls[i].sphere.centre - scene.balls[j].sphere.centre), 36.0);
            for (int v = 0; v < scene.view.height; ++v)
                for (int u = 0; u < scene.view.width; ++u)
                    if (truth.mask[static_cast<std::size_t>(v * scene.view.width + u)] != 0) {
                        ASSERT_GT(std::hypot(u - ball.centre.u, v - ball.centre.v), ball.radius) << shape;
                    }
        }
    }
}

TEST(Scenes, EveryLampShowsItsHighlightAndNoShadowOfTheBallFallsOnTheObject) {
    const RigDescription rig = parse_rig(simulated_rig_toml(12), "simulated rig");
    for (const std::string shape : {"sphere", "torus", "teapot", "relief"}) {
        SimDescription sim = rig.sim;
        sim.scene = shape + "-lambert";
        sim.width = 96;
        sim.height = 72;
        const Scene scene = scene_by_name(sim, rig.lamps, *rig.ball_diameter_mm);
        Scene alone = scene;
        alone.balls.clear();
        const BallCircle ball = ball_circle(scene.view, scene.balls.front().sphere);
        const SceneTruth truth = render_truth(scene);
        std::vector<LampId> ids;
        for (std::uint32_t i = 0; i < rig.lamps.size(); ++i) ids.push_back({i});
        const auto with = Renderer(scene).render(ids);
        const auto without = Renderer(alone).render(ids);
        for (std::size_t i = 0; i < ids.size(); ++i) {
            bool highlight = false;
            for (int v = 0; v < 72; ++v)
                for (int u = 0; u < 96; ++u) {
                    if (shows_nothing_but_the_object(truth, u, v)) {
                        ASSERT_EQ(with[i].pixel(u, v)[0], without[i].pixel(u, v)[0])
                            << shape << ' ' << i << " at " << u << ' ' << v;
                    }
                    highlight |= std::hypot(u - ball.centre.u, v - ball.centre.v) < ball.radius &&
                                 with[i].pixel(u, v)[0] > 1.05F;
                }
            EXPECT_TRUE(highlight) << shape << " lamp " << i;
        }
    }
}

TEST(Scenes, BrightestDiffusePartsUseTheSensorWell) {
    for (const std::string name : {"brick-torus", "stone-sphere", "teapot-moss", "teapot-marble", "teapot-speckle",
                                   "sphere-weave-cloth40", "sphere-print-cloth40", "sphere-melon"}) {
        const Scene scene = scene_of(name, 160, lamps_at({{0, 0.2, 1}}));
        const SceneTruth truth = render_truth(scene);
        const RgbImage image = render_radiance(scene, LampId{0});
        std::vector<float> samples;
        for (std::size_t i = 0; i < truth.mask.size(); ++i)
            if (truth.mask[i] != 0) samples.insert(samples.end(), &image.samples[3 * i], &image.samples[3 * i] + 3);
        const auto place = samples.begin() + static_cast<std::ptrdiff_t>(0.997 * static_cast<double>(samples.size()));
        std::nth_element(samples.begin(), place, samples.end());
        const double of_full_scale = *place / Sensor{}.full_scale_radiance;
        EXPECT_GT(of_full_scale, 0.65) << name;
        EXPECT_LT(of_full_scale, 0.88) << name;
    }
}

TEST(Textures, AreStochasticAndRepeatableBySeed) {
    for (const auto make : {stone_texture, moss_texture, marble_texture, speckle_texture, brick_texture, weave_texture,
                            print_texture, melon_texture}) {
        const auto colours = [&](std::uint64_t seed) {
            const TexturePtr texture = make(seed);
            std::vector<double> green;
            for (int i = 0; i < 4000; ++i) {
                SurfacePoint point;
                point.position = {0.9 * (i % 63), 1.1 * (i / 63), 0.3 * (i % 7)};
                point.uv = {point.position.x / 20, point.position.y / 10};
                green.push_back(texture->albedo(point).g);
            }
            return green;
        };
        const auto first = colours(1);
        EXPECT_EQ(first, colours(1));
        EXPECT_NE(first, colours(2));
        double sum = 0.0, squares = 0.0;
        for (const double g : first) {
            EXPECT_GE(g, 0.0);
            EXPECT_LE(g, 1.0);
            sum += g, squares += g * g;
        }
        const double mean = sum / 4000;
        EXPECT_GT(std::sqrt(squares / 4000 - mean * mean), 0.05);
    }
}

TEST(Textures, TilesCloseWithoutASeam) {
    for (const auto make : {brick_texture, weave_texture, print_texture}) {
        const TexturePtr texture = make(1);
        for (int i = 0; i < 200; ++i) {
            SurfacePoint left;
            left.period_u = 12;
            left.period_v = 10;
            left.uv = {1e-7, 0.05 * i + 0.013};  // no two threads are equally high there
            SurfacePoint right = left;
            right.uv.u = 12 - 1e-7;
            EXPECT_NEAR(texture->albedo(left).r, texture->albedo(right).r, 1e-4);
            EXPECT_NEAR(texture->height_mm(left), texture->height_mm(right), 1e-4);
        }
    }
}

/// Of each material, the share of a plane's points and their mean height above it.
struct MaterialShare {
    double share = 0.0;
    double height_mm = 0.0;
};

std::vector<MaterialShare> materials_of(const Texture& texture) {
    std::vector<MaterialShare> found;
    constexpr int side = 200;
    for (int i = 0; i < side * side; ++i) {
        SurfacePoint point;
        point.position = {0.5 * (i % side), 0.5 * (i / side), 0.0};
        point.uv = {point.position.x / 15.2, point.position.y / 7.6};
        const auto material = static_cast<std::size_t>(texture.material(point));
        if (found.size() <= material) found.resize(material + 1);
        found[material].share += 1;
        found[material].height_mm += texture.height_mm(point);
    }
    for (MaterialShare& one : found) {
        one.height_mm /= one.share;
        one.share /= side * side;
    }
    return found;
}

TEST(Textures, ThreadsOfAWeaveShareTheGroundAndRiseByTurns) {
    const TexturePtr weave = weave_texture(1);
    const auto found = materials_of(*weave);
    ASSERT_EQ(found.size(), 2U);
    EXPECT_NEAR(found[0].share, 0.5, 0.01);
    EXPECT_NEAR(found[0].height_mm, found[1].height_mm, 0.005);
    const auto at = [](double u, double v) {
        SurfacePoint point;
        point.uv = {u, v};
        return point;
    };
    // Cells are a quarter of a tile long and half of one high.
    for (const double u : {0.125, 0.375, 5.125}) {
        EXPECT_NE(weave->material(at(u, 0.25)), weave->material(at(u, 0.75)));
        EXPECT_NE(weave->material(at(u, 0.25)), weave->material(at(u + 0.25, 0.25)));
        EXPECT_DOUBLE_EQ(weave->height_mm(at(u, 0.25)), 0.45);
        EXPECT_NEAR(weave->height_mm(at(u + 0.125, 0.5)), 0.0, 1e-9);  // the hole between four crossings
    }
}

TEST(Textures, APrintHasGroundPetalsAndHearts) {
    const auto found = materials_of(*print_texture(1));
    ASSERT_EQ(found.size(), 3U);
    EXPECT_GT(found[0].share, 0.5);
    EXPECT_GT(found[1].share, 0.15);
    EXPECT_GT(found[2].share, 0.01);
    EXPECT_LT(found[2].share, found[1].share);
}

TEST(Textures, AMelonsNetStandsAboveItsRind) {
    const auto found = materials_of(*melon_texture(1));
    ASSERT_EQ(found.size(), 2U);
    EXPECT_GT(found[1].share, 0.15);
    EXPECT_LT(found[1].share, 0.5);
    EXPECT_GT(found[1].height_mm, found[0].height_mm + 0.3);
}

TEST(Textures, ReliefTurnsTheNormalAgainstTheSlope) {
    class Ramp final : public Texture {
        Rgb albedo(const SurfacePoint&) const override { return {}; }
        double height_mm(const SurfacePoint& p) const override { return 0.3 * p.position.x - 0.4 * p.position.y; }
        bool has_relief() const override { return true; }
    };
    const Vec3 n = normal_with_relief(Ramp{}, {}, {0, 0, 1});
    const Vec3 expected = unit({-0.3, 0.4, 1});
    EXPECT_NEAR(n.x, expected.x, 1e-9);
    EXPECT_NEAR(n.y, expected.y, 1e-9);
    EXPECT_NEAR(n.z, expected.z, 1e-9);
}

TEST(Meshes, HeightFieldNormalsAreAcrossTheSlope) {
    const TriangleMesh mesh = height_field_mesh({100, 80, [](double x, double y) { return 0.3 * x - 0.2 * y; }}, 10);
    const Vec3 expected = unit({-0.3, 0.2, 1});
    for (const Vertex& vertex : mesh.vertices) EXPECT_LT(length(vertex.normal - expected), 1e-8);
}

}  // namespace
}  // namespace darkbox::sim
