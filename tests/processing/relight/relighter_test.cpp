#include "processing/relight/relighter.h"

#include <gmock/gmock.h>
#include <hwy/highway.h>

#include <cmath>
#include <random>
#include <vector>

#include "acquisition/frame/error.h"
#include "processing/maps/srgb.h"
#include "tests/processing/relight/sphere_scene.h"
#include "tests/support/throws.h"

namespace darkbox {
namespace {

using test::largest_difference;
using test::light_from;
using testing::HasSubstr;

constexpr int texels = 40;
constexpr int levels = 10;

/// A bowl 20 mm deep under a camera 300 mm away; a hole in it has no height.
SceneGeometry bowl(cv::Size size) {
    SceneGeometry geometry{ViewGeometry{0.5, {0.4 * size.width, 0.6 * size.height}, 300}, cv::Mat1f(size)};
    for (int y = 0; y < size.height; ++y)
        for (int x = 0; x < size.width; ++x) {
            const double off_centre = std::hypot(x - 0.5 * size.width, y - 0.5 * size.height);
            geometry.height_mm(y, x) = x % 17 == 3 ? std::nanf("") : static_cast<float>(20 * off_centre / size.width);
        }
    return geometry;
}

/// Normals of the whole sphere, texels and albedo at random; curves of S that are anything but straight.
RelightScene random_scene(cv::Size size) {
    std::mt19937 random(7);
    std::uniform_real_distribution<float> unit(0, 1);
    std::normal_distribution<float> normal;
    RelightScene scene{{cv::Mat3f(size), cv::Mat1b(size, uchar{255})},
                       {cv::Mat3f(size), cv::Mat1b(size, uchar{255})},
                       {cv::Mat1w(size), texels},
                       {texels, levels, cv::Mat3f(texels, levels), cv::Mat1i(texels, levels, 9), cv::Mat3f(texels, 1)}};
    for (cv::Vec3f& n : scene.normals.normal)
        n = cv::normalize(cv::Vec3f(normal(random), normal(random), normal(random)));
    for (cv::Vec3f& a : scene.albedo.albedo) a = {unit(random), unit(random), unit(random)};
    for (std::uint16_t& label : scene.index.label) label = static_cast<std::uint16_t>(1 + random() % texels);
    for (int k = 0; k < texels; ++k) {
        scene.shading.mean_albedo(k, 0) = cv::Vec3f::all(0.3F + 0.4F * unit(random));
        for (int i = 0; i < levels; ++i)
            scene.shading.radiance(k, i) =
                i == 0 ? cv::Vec3f(0, 0, 0) : cv::Vec3f(unit(random), unit(random), unit(random));
    }
    scene.geometry = bowl(size);
    return scene;
}

/// S(k, r) of one pixel, straight from the definition.
cv::Vec3d shading_at(const RelightScene& scene, int y, int x, double r, OutOfRange beyond) {
    const double position = std::clamp(r, 0.0, 1.0) * (levels - 1);
    const int below = std::min(static_cast<int>(position), levels - 2);
    const cv::Vec3f* level = scene.shading.radiance[scene.index.label(y, x) - 1] + below;
    const cv::Vec3d value = cv::Vec3d(level[0]) * (1 - (position - below)) + cv::Vec3d(level[1]) * (position - below);
    return beyond == OutOfRange::scale ? value * std::max(1.0, r) : value;
}

/// Every model in double precision, one pixel after the other.
cv::Mat3f reference(const RelightScene& scene, const Lights& lights, const RelightOptions& o) {
    cv::Mat3f image(scene.index.label.size(), cv::Vec3f(0, 0, 0));
    for (int y = 0; y < image.rows; ++y)
        for (int x = 0; x < image.cols; ++x) {
            if (scene.index.label(y, x) == 0 || scene.normals.valid(y, x) == 0) continue;
            const cv::Vec3d n = cv::normalize(cv::Vec3d(scene.normals.normal(y, x)));
            cv::Vec3d detail(1, 1, 1);
            if (o.lookup == Lookup::detail && scene.albedo.valid(y, x) != 0)
                cv::divide(cv::Vec3d(scene.albedo.albedo(y, x)),
                           cv::Vec3d(scene.shading.mean_albedo(scene.index.label(y, x) - 1, 0)), detail);
            cv::Vec3d sum(0, 0, 0);
            for (const Light& light : lights) {
                const Incidence at =
                    light.near ? incidence(light, scene.geometry.point_at(y, x)) : Incidence{light.direction, 1};
                const cv::Vec3d l(at.direction[0], at.direction[1], at.direction[2]);
                const cv::Vec3d e(at.falloff * light.intensity[0], at.falloff * light.intensity[1],
                                  at.falloff * light.intensity[2]);
                const double cosine = std::max(0.0, n.dot(l));
                const double mirrored = std::max(0.0, 2 * cosine * n[2] - l[2]);
                const double gloss = cosine > 0 ? o.phong_specular * std::pow(mirrored, o.phong_exponent) : 0;
                if (o.model == ReflectanceModel::lambert)
                    sum += e.mul(detail).mul(shading_at(scene, y, x, cosine, o.out_of_range));
                else if (o.model == ReflectanceModel::phong)
                    sum += e.mul(detail).mul(shading_at(scene, y, x, o.phong_diffuse * cosine + gloss, o.out_of_range));
                else
                    sum += o.phong_diffuse * e.mul(detail).mul(shading_at(scene, y, x, cosine, o.out_of_range)) +
                           gloss * e.mul(o.specular_colour);
            }
            image(y, x) = sum * o.exposure;
        }
    return image;
}

Light coloured(double x, double y, double z, const Eigen::Vector3d& colour) {
    Light light = light_from(x, y, z);
    light.intensity = colour;
    return light;
}

Light lamp_at(const Eigen::Vector3d& position_mm, const Eigen::Vector3d& colour) {
    Light light;
    light.near = LampPosition{position_mm, {5, -3, 0}};
    light.direction = (position_mm - light.near->object_mm).normalized();
    light.intensity = colour;
    return light;
}

struct Setting {
    const char* name;
    Lights lights;
    RelightOptions options;
};

std::vector<Setting> settings() {
    const Lights one{coloured(0.4, 0.3, 0.8, {1.0, 0.8, 0.6})};
    const Lights three{coloured(-1, 0.3, 0.7, {0.5, 0.3, 0.1}), coloured(1, 0.3, 0.7, {0.1, 0.3, 0.5}),
                       coloured(0, 1, -0.2, {0.2, 0.9, 0.1})};
    RelightOptions lambert;
    RelightOptions thesis = lambert;
    thesis.lookup = Lookup::thesis;
    thesis.exposure = 0.7;
    RelightOptions phong = thesis;
    phong.model = ReflectanceModel::phong;
    RelightOptions narrow = phong;
    narrow.phong_exponent = 1000;
    narrow.phong_specular = 0.9;
    RelightOptions scaled = narrow;
    scaled.phong_exponent = 7.5;
    scaled.phong_diffuse = 0.8;
    scaled.out_of_range = OutOfRange::scale;
    RelightOptions split = scaled;
    split.model = ReflectanceModel::phong_split;
    split.lookup = Lookup::detail;
    split.specular_colour = {0.9, 0.5, 0.2};
    const Lights near{lamp_at({-30, 20, 60}, {0.8, 0.7, 0.6}), coloured(1, 0.3, 0.7, {0.1, 0.3, 0.5}),
                      lamp_at({40, 10, 90}, {0.3, 0.5, 0.6})};
    RelightOptions near_phong = phong;
    near_phong.exposure = 0.4;
    RelightOptions near_split = split;
    near_split.exposure = 0.4;
    return {{"near", {near[0]}, lambert}, {"near_phong", near, near_phong}, {"near_split", near, near_split},
            {"lambert", one, lambert},    {"thesis", three, thesis},        {"phong", three, phong},
            {"narrow", one, narrow},      {"scaled", one, scaled},          {"split", three, split}};
}

class RelighterModels : public testing::TestWithParam<Setting> {};

TEST_P(RelighterModels, FloatsAreTheDefinition) {
    const RelightScene scene = random_scene({131, 77});
    cv::Mat3f image(scene.index.label.size());
    Relighter(scene).render(GetParam().lights, GetParam().options, image);
    const cv::Mat3f truth = reference(scene, GetParam().lights, GetParam().options);
    // The power of 1000 makes 6e-5 of a float's last bit in R.V.
    const double tolerance = GetParam().options.phong_exponent > 100 ? 2e-4 : 1e-5;
    EXPECT_LT(largest_difference(image, truth), tolerance);
    EXPECT_GT(cv::norm(truth, cv::NORM_INF), 0.5);
}

TEST_P(RelighterModels, BytesAreTheFloatsWithinOneLevel) {
    const RelightScene scene = random_scene({131, 77});
    const Relighter relighter(scene);
    cv::Mat3f floats(relighter.size());
    cv::Mat3b bytes(relighter.size());
    relighter.render(GetParam().lights, GetParam().options, floats);
    relighter.render(GetParam().lights, GetParam().options, Encoding::srgb, bytes);
    const cv::Mat3b srgb = viewable(floats);
    EXPECT_LE(largest_difference(bytes, srgb), 1);
    EXPECT_LT(cv::norm(bytes, srgb, cv::NORM_L1) / (3.0 * bytes.size().area()), 0.06);

    relighter.render(GetParam().lights, GetParam().options, Encoding::linear, bytes);
    cv::Mat3b linear;
    floats.convertTo(linear, CV_8U, 255);
    EXPECT_LE(largest_difference(bytes, linear), 1);
}

TEST_P(RelighterModels, SameBitsOnAnyNumberOfThreads) {
    const Relighter relighter(random_scene({131, 77}));
    const auto rendered = [&](int threads) {
        const WorkContext work{.report = {}, .stop = {}, .threads = threads};
        cv::Mat3b bytes(relighter.size());
        cv::Mat3f floats(relighter.size());
        relighter.render(GetParam().lights, GetParam().options, Encoding::srgb, bytes, work);
        relighter.render(GetParam().lights, GetParam().options, floats, work);
        return std::pair(bytes, floats);
    };
    const auto [bytes, floats] = rendered(1);
    for (const int threads : {2, 8}) {
        const auto [same_bytes, same_floats] = rendered(threads);
        EXPECT_EQ(largest_difference(bytes, same_bytes), 0);
        EXPECT_EQ(largest_difference(floats, same_floats), 0);
    }
}

INSTANTIATE_TEST_SUITE_P(Settings, RelighterModels, testing::ValuesIn(settings()),
                         [](const auto& setting) { return std::string(setting.param.name); });

/// Lets Highway use one of its targets alone as long as it lives.
class OnlyTarget {
public:
    explicit OnlyTarget(std::int64_t target) { choose(target); }
    OnlyTarget(const OnlyTarget&) = delete;
    OnlyTarget& operator=(const OnlyTarget&) = delete;
    ~OnlyTarget() { choose(0); }

private:
    static void choose(std::int64_t targets) {
        hwy::SetSupportedTargetsForTest(targets);
        hwy::GetChosenTarget().Update(hwy::SupportedTargets());
    }
};

TEST(Relighter, EveryKindOfProcessorAgrees) {
    const RelightScene scene = random_scene({131, 77});
    int kinds = 0;
    const std::int64_t here = hwy::SupportedTargets() & HWY_TARGETS;
    for (int bit = 0; bit < 63; ++bit) {
        const std::int64_t target = std::int64_t{1} << bit;
        if ((here & target) == 0) continue;
        ++kinds;
        const OnlyTarget only(target);
        const Relighter relighter(scene);
        for (const Setting& setting : settings()) {
            const cv::Mat3f truth = reference(scene, setting.lights, setting.options);
            cv::Mat3f floats(relighter.size());
            cv::Mat3b bytes(relighter.size());
            relighter.render(setting.lights, setting.options, floats);
            relighter.render(setting.lights, setting.options, Encoding::srgb, bytes);
            EXPECT_LT(largest_difference(floats, truth), 2e-4) << hwy::TargetName(target);
            EXPECT_LE(largest_difference(bytes, viewable(floats)), 1) << hwy::TargetName(target);
        }
    }
    EXPECT_GE(kinds, 1);
}

TEST(Relighter, EveryByteOfTheCurveIsSrgb) {
    // One texel whose S is the ramp 0...1, one row of pixels that take 4001 values from it.
    const cv::Size size(4001, 1);
    RelightScene scene{{cv::Mat3f(size), cv::Mat1b(size, uchar{255})},
                       {cv::Mat3f(size, cv::Vec3f(1, 1, 1)), cv::Mat1b(size, uchar{255})},
                       {cv::Mat1w(size, std::uint16_t{1}), 1},
                       {1, 2, cv::Mat3f(1, 2), cv::Mat1i(1, 2, 9), cv::Mat3f(1, 1, cv::Vec3f(1, 1, 1))}};
    scene.shading.radiance(0, 0) = {0, 0, 0};
    scene.shading.radiance(0, 1) = {1, 1, 1};
    for (int x = 0; x < size.width; ++x) {
        const double r = x / 4000.0;
        scene.normals.normal(0, x) = cv::Vec3d(std::sqrt(1 - r * r), 0, r);
    }
    cv::Mat3b image(size);
    Relighter(scene).render({light_from(0, 0, 1)}, {}, Encoding::srgb, image);
    int last = 0;
    for (int x = 0; x < size.width; ++x) {
        const double exact = 255 * static_cast<double>(srgb_from_linear(scene.normals.normal(0, x)[2]));
        EXPECT_NEAR(image(0, x)[0], exact, 0.75) << x;  // half a level of rounding, and a quarter
        EXPECT_GE(image(0, x)[0], last);
        last = image(0, x)[0];
    }
    EXPECT_EQ(image(0, 0), cv::Vec3b(0, 0, 0));
    EXPECT_EQ(last, 255);
}

TEST(Relighter, OutsideIsBlackWhateverTheBufferHeld) {
    RelightScene scene = random_scene({200, 9});
    cv::theRNG().state = 3;
    for (int y = 0; y < 9; ++y)
        for (int x = 0; x < 200; ++x)
            if (y == 4 || cv::theRNG().uniform(0, 100) < (x > 70 ? 98 : 30)) {
                if (x % 2 == 0)
                    scene.index.label(y, x) = 0;
                else
                    scene.normals.valid(y, x) = 0;
            }
    const Relighter relighter(scene);
    RelightOptions split;
    split.model = ReflectanceModel::phong_split;
    const Lights lights{light_from(0, 0, 1)};
    cv::Mat3b bytes(relighter.size(), cv::Vec3b(77, 77, 77));
    cv::Mat3f floats(relighter.size(), cv::Vec3f(7, 7, 7));
    relighter.render(lights, split, floats);
    relighter.render(lights, split, Encoding::srgb, bytes);
    EXPECT_LE(largest_difference(bytes, viewable(floats)), 1);
    for (int y = 0; y < 9; ++y)
        for (int x = 0; x < 200; ++x)
            if (scene.index.label(y, x) == 0 || scene.normals.valid(y, x) == 0) {
                EXPECT_EQ(bytes(y, x), cv::Vec3b(0, 0, 0));
                EXPECT_EQ(floats(y, x), cv::Vec3f(0, 0, 0));
            }
}

TEST(Relighter, WritesIntoAViewAndNothingBesideIt) {
    const Relighter relighter(random_scene({70, 20}));
    const Lights lights{light_from(0.2, 0.3, 1)};
    cv::Mat3b alone(relighter.size());
    relighter.render(lights, {}, Encoding::srgb, alone);
    cv::Mat3b wall(40, 100, cv::Vec3b(9, 8, 7));
    cv::Mat3b view = wall(cv::Rect(11, 5, 70, 20));
    relighter.render(lights, {}, Encoding::srgb, view);
    EXPECT_EQ(largest_difference(view, alone), 0);
    view.setTo(cv::Scalar(9, 8, 7));
    EXPECT_EQ(largest_difference(wall, cv::Mat3b(40, 100, cv::Vec3b(9, 8, 7))), 0);
}

TEST(Relighter, EnvironmentBytesAreTheFloatsWithinOneLevel) {
    const Relighter relighter(random_scene({131, 77}));
    Environment probe{cv::Mat3f(32, 64)};
    cv::theRNG().state = 9;
    cv::randu(probe.radiance, cv::Scalar::all(0), cv::Scalar::all(1.5));
    for (const Setting& setting : settings()) {
        const FoldedEnvironment folded = relighter.fold(probe, setting.options);
        cv::Mat3f floats(relighter.size());
        cv::Mat3b bytes(relighter.size());
        relighter.render(folded, setting.options, floats);
        relighter.render(folded, setting.options, Encoding::srgb, bytes);
        EXPECT_LE(largest_difference(bytes, viewable(floats)), 1) << setting.name;
    }
}

TEST(Relighter, OddSizesAreFine) {
    for (const cv::Size size : {cv::Size(1, 1), cv::Size(3, 5000), cv::Size(5000, 3), cv::Size(65, 2)}) {
        const RelightScene scene = random_scene(size);
        const Lights lights{light_from(0.2, 0.3, 1)};
        const Relighter relighter(scene);
        cv::Mat3b bytes(size);
        relighter.render(lights, {}, Encoding::srgb, bytes);
        EXPECT_LE(largest_difference(bytes, viewable(reference(scene, lights, {}))), 1);
    }
}

TEST(Relighter, AnEmptyMaskIsABlackPicture) {
    RelightScene scene = random_scene({30, 20});
    scene.index.label.setTo(0);
    cv::Mat3b bytes(20, 30, cv::Vec3b(1, 2, 3));
    Relighter(scene).render({light_from(0, 0, 1)}, {}, Encoding::srgb, bytes);
    EXPECT_EQ(cv::norm(bytes, cv::NORM_INF), 0);
}

TEST(Relighter, RefusesABufferOfAnotherSize) {
    const Relighter relighter(random_scene({30, 20}));
    cv::Mat3b turned(30, 20);
    cv::Mat3f none;
    EXPECT_THAT(test::input_error_of([&] { relighter.render({light_from(0, 0, 1)}, {}, Encoding::srgb, turned); }),
                HasSubstr("buffer"));
    EXPECT_THAT(test::input_error_of([&] { relighter.render({light_from(0, 0, 1)}, {}, none); }), HasSubstr("buffer"));
}

TEST(Relighter, ALampFarAwayIsADistantLight) {
    RelightScene scene = random_scene({70, 20});
    scene.geometry = {ViewGeometry{0.1, {35, 10}}, {}};
    const Relighter relighter(scene);
    Light far = light_from(0.3, -0.2, 1);
    cv::Mat3f distant(relighter.size()), near(relighter.size());
    relighter.render({far}, {}, distant);
    far.near = LampPosition{1e6 * far.direction};
    relighter.render({far}, {}, near);
    EXPECT_LT(largest_difference(near, distant), 1e-3);
}

TEST(Relighter, RefusesALampThatItCannotPlace) {
    RelightScene scene = random_scene({30, 20});
    const Light lamp = lamp_at({0, 0, 50}, {1, 1, 1});
    Light in_the_object = lamp;
    in_the_object.near->position_mm = in_the_object.near->object_mm;
    cv::Mat3f image(scene.index.label.size());
    EXPECT_THAT(test::input_error_of([&] { Relighter(scene).render({in_the_object}, {}, image); }),
                HasSubstr("no lamp can stand"));
    scene.geometry.height_mm = cv::Mat1f(20, 29, 0.0F);
    EXPECT_THAT(test::input_error_of([&] { Relighter{scene}; }), HasSubstr("height map"));
    scene.geometry = {};
    EXPECT_THAT(test::input_error_of([&] { Relighter(scene).render({lamp}, {}, image); }),
                HasSubstr("where the object's pixels lie"));
}

}  // namespace
}  // namespace darkbox
