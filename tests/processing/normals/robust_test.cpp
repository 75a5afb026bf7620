// The robust solver on materials known exactly: what it leaves out, which law it finds, and what it costs where least
// squares is right.

#include <gtest/gtest.h>

#include <cstring>
#include <string>

#include "acquisition/frame/error.h"
#include "processing/normals/gloss_law.h"
#include "tests/processing/normals/lit_sphere.h"

namespace darkbox {
namespace {

using test::LitSphere;
using test::mean_of;
using test::same_bits;
using test::spiral_lights;

PhotometricStereoOptions with(Solver solver) {
    PhotometricStereoOptions options;
    options.solver = solver;
    return options;
}

double mean_error_deg(const LitSphere& sphere, Solver solver) {
    return mean_of(sphere.errors_deg(photometric_stereo(sphere.stack, sphere.lights, with(solver))));
}

/// A channel of a 12-bit camera with a well of 20,000 electrons.
const NoiseModel camera_noise{3e-4, 5e-5, 0};

test::Reflect phong(double strength, double exponent) {
    return [=](const Eigen::Vector3d& n, const Eigen::Vector3d& l, const Eigen::Vector3d& v) {
        const Eigen::Vector3d mirrored = 2 * n.dot(l) * n - l;
        return test::lambert(n, l, v) + strength * std::pow(std::max(0.0, mirrored.dot(v)), exponent);
    };
}

TEST(Robust, ExactLambertSphereWithAttachedShadows) {
    const LitSphere sphere(spiral_lights(24), test::lambert);
    const auto result = photometric_stereo(sphere.stack, sphere.lights, with(Solver::robust));
    EXPECT_LE(test::quantile(sphere.errors_deg(result), 1.0), 0.02);
    EXPECT_EQ(result.model.law.name(), "lambert");
    EXPECT_NEAR(result.albedo.albedo(24, 24)[1], 0.6, 1e-4);
    EXPECT_LT(result.lights_used(24, 1), 24);
    EXPECT_EQ(result.lights_used(24, 24), 24);
}

class KeepUses : public SampleUseSink {
public:
    KeepUses(std::size_t photographs, cv::Size size) : pictures(photographs, cv::Mat1b(size, uchar{1})) {
        for (cv::Mat1b& picture : pictures) picture = picture.clone();
    }
    void take(int row, std::size_t photograph, std::span<const SampleUse> uses) override {
        std::memcpy(pictures[photograph].ptr(row), uses.data(), uses.size());
    }
    SampleUse at(std::size_t photograph, int y, int x) const {
        return static_cast<SampleUse>(pictures[photograph](y, x));
    }

    std::vector<cv::Mat1b> pictures;
};

TEST(Robust, TellsWhatItTookEachSampleFor) {
    LitSphere sphere(spiral_lights(24), test::lambert);
    sphere.lights[7].used = false;
    sphere.stack.images[5](24, 20) *= 3.0F;
    sphere.stack.clipped[6](24, 20) = 255;
    sphere.stack.images[8](24, 20) *= 0.3F;  // something is in the light's way
    KeepUses uses(24, sphere.stack.mask.size());
    PhotometricStereoOptions options = with(Solver::robust);
    options.uses = &uses;
    options.band_rows = 5;
    photometric_stereo(sphere.stack, sphere.lights, options);
    EXPECT_EQ(uses.at(4, 24, 20), SampleUse::kept);
    EXPECT_EQ(uses.at(5, 24, 20), SampleUse::highlight);
    EXPECT_EQ(uses.at(6, 24, 20), SampleUse::clipped);
    EXPECT_EQ(uses.at(7, 24, 20), static_cast<SampleUse>(1)) << "nothing is said of a light that is not used";
    EXPECT_EQ(uses.at(8, 24, 20), SampleUse::shadow);
    EXPECT_EQ(uses.at(5, 0, 0), SampleUse::no_normal);
    for (const std::size_t i : {0U, 12U, 23U})
        for (int y = 0; y < 48; ++y)
            for (int x = 0; x < 48; ++x) {
                if (!sphere.stack.mask(y, x) || (y == 24 && x == 20)) continue;
                const double cosine = sphere.normal(y, x).dot(sphere.lights[i].direction);
                if (cosine < 0.1) {
                    EXPECT_EQ(uses.at(i, y, x), SampleUse::shadow) << i << ' ' << y << ' ' << x;
                }
                if (cosine > 0.2) {
                    EXPECT_EQ(uses.at(i, y, x), SampleUse::kept) << i << ' ' << y << ' ' << x;
                }
            }
}

TEST(Robust, LeastSquaresTellsNothingOfSamples) {
    const LitSphere sphere(spiral_lights(6), test::lambert);
    KeepUses uses(6, sphere.stack.mask.size());
    PhotometricStereoOptions options = with(Solver::lsq);
    options.uses = &uses;
    EXPECT_THROW(photometric_stereo(sphere.stack, sphere.lights, options), InputError);
}

TEST(Robust, HighlightsAreLeftOut) {
    for (const double strength : {0.3, 0.6})
        for (const double exponent : {10.0, 30.0, 100.0}) {
            LitSphere sphere(spiral_lights(24), phong(strength, exponent), 48, 75);
            sphere.add_noise(camera_noise, 1);
            EXPECT_LE(mean_error_deg(sphere, Solver::robust), mean_error_deg(sphere, Solver::lsq) / 3)
                << strength << ' ' << exponent;
        }
}

TEST(Robust, FindsABroadLobeAndKeepsItOutOfTheAlbedo) {
    const LitSphere sphere(spiral_lights(24), phong(0.3, 10), 48, 75);
    const auto result = photometric_stereo(sphere.stack, sphere.lights, with(Solver::robust));
    EXPECT_EQ(result.model.law.kind, BodyKind::lambert);
    EXPECT_NEAR(result.model.gloss.strength, 0.3, 0.1);
    EXPECT_NEAR(result.model.gloss.exponent, 10, 3);
    EXPECT_LE(mean_of(sphere.errors_deg(result)), 0.1);
    EXPECT_NEAR(result.albedo.albedo(24, 24)[1], 0.6, 0.03);
}

TEST(Robust, FindsNoLobeOnMattBodies) {
    LitSphere sphere(spiral_lights(24), test::lambert, 48, 75);
    sphere.add_noise(camera_noise, 1);
    EXPECT_FALSE(photometric_stereo(sphere.stack, sphere.lights, with(Solver::robust)).model.gloss.present());
}

/// The derivative that the solver steps along, against differences.
TEST(Gloss, SlopeIsTheDerivative) {
    const GlossLaw law{0.4, 10};
    const Eigen::Vector3f normal = Eigen::Vector3f(0.2F, -0.3F, 0.9F).normalized();
    const Eigen::Vector3f light = Eigen::Vector3f(0.5F, -0.2F, 0.8F).normalized(), view(0, 0, 1);
    constexpr float step = 1e-3F;
    for (int axis = 0; axis < 3; ++axis) {
        const Eigen::Vector3f d = step * Eigen::Vector3f::Unit(axis);
        const float change =
            gloss_at(law, normal + d, light, view).value - gloss_at(law, normal - d, light, view).value;
        EXPECT_NEAR(gloss_at(law, normal, light, view).slope[axis], change / (2 * step), 2e-3F) << axis;
    }
    EXPECT_EQ(gloss_at(law, normal, -normal, view).value, 0.0F);
}

TEST(Robust, CostsNothingWhereLeastSquaresIsRight) {
    for (const int lights : {4, 5, 6, 9, 12, 24}) {
        double robust = 0, least_squares = 0;
        for (unsigned seed = 1; seed <= 2; ++seed) {
            LitSphere sphere(spiral_lights(lights), test::lambert, 48, 28);
            sphere.add_noise(camera_noise, seed);
            robust += mean_error_deg(sphere, Solver::robust);
            least_squares += mean_error_deg(sphere, Solver::lsq);
        }
        EXPECT_LE(robust, 1.02 * least_squares) << lights;
    }
}

TEST(Robust, RoughCloth) {
    const auto oren_nayar = [](const Eigen::Vector3d& n, const Eigen::Vector3d& l, const Eigen::Vector3d& v) {
        const double variance = 0.3 * 0.3, a = 1 - 0.5 * variance / (variance + 0.33);
        const double b = 0.45 * variance / (variance + 0.09);
        const double s = l.dot(v) - n.dot(l) * n.dot(v), t = std::max(n.dot(l), n.dot(v));
        return 0.6 * n.dot(l) * (a + (s > 0 ? b * s / t : 0.0));
    };
    LitSphere sphere(spiral_lights(24), oren_nayar, 48, 75);
    sphere.add_noise(camera_noise, 1);
    const auto result = photometric_stereo(sphere.stack, sphere.lights, with(Solver::robust));
    EXPECT_EQ(result.model.law.kind, BodyKind::rough);
    EXPECT_LE(mean_of(sphere.errors_deg(result)), mean_error_deg(sphere, Solver::lsq) / 3);
}

TEST(Robust, ClippedSamplesAreLeftOut) {
    LitSphere sphere(spiral_lights(12), test::lambert, 48, 30);
    for (std::size_t i = 0; i < 12; i += 3) {
        sphere.stack.images[i](24, 20) = cv::Vec3f::all(0.2F);
        sphere.stack.clipped[i](24, 20) = 255;
    }
    const auto result = photometric_stereo(sphere.stack, sphere.lights, with(Solver::robust));
    EXPECT_LE(sphere.error_deg(result, 24, 20), 0.02);
    EXPECT_EQ(result.lights_used(24, 20), 8);
}

TEST(Robust, CastShadowsAreLeftOut) {
    LitSphere sphere(spiral_lights(16), test::lambert, 48, 30);
    for (const std::size_t i : {2U, 7U, 8U, 13U}) sphere.stack.images[i](24, 24) = cv::Vec3f::all(0.004F);
    const auto result = photometric_stereo(sphere.stack, sphere.lights, with(Solver::robust));
    EXPECT_LE(sphere.error_deg(result, 24, 24), 0.02);
    EXPECT_EQ(result.lights_used(24, 24), 12);
}

TEST(Robust, FindsTheSensorsNoise) {
    LitSphere sphere(spiral_lights(16), test::lambert, 96);
    sphere.add_noise({1e-3, 1e-4, 0}, 5);
    const auto result = photometric_stereo(sphere.stack, sphere.lights, with(Solver::robust));
    // The mean of three channels has a third of a channel's variance.
    for (const double radiance : {0.1, 0.3, 0.5})
        EXPECT_NEAR(result.model.noise.variance(radiance) / ((1e-6 + 1e-4 * radiance) / 3), 1.0, 0.15) << radiance;
}

TEST(Robust, SameBitsOnAnyNumberOfThreadsAndForAnyBands) {
    LitSphere sphere(spiral_lights(12), phong(0.3, 30));
    sphere.add_noise(camera_noise, 3);
    WorkContext one;
    one.threads = 1;
    const auto expected = photometric_stereo(sphere.stack, sphere.lights, with(Solver::robust), one);
    for (const int threads : {2, 8})
        for (const int band_rows : {0, 5}) {
            WorkContext work;
            work.threads = threads;
            auto options = with(Solver::robust);
            options.band_rows = band_rows;
            const auto result = photometric_stereo(sphere.stack, sphere.lights, options, work);
            EXPECT_TRUE(same_bits(result.normals.normal, expected.normals.normal));
            EXPECT_TRUE(same_bits(result.albedo.albedo, expected.albedo.albedo));
            EXPECT_TRUE(same_bits(result.sigma_deg, expected.sigma_deg));
            EXPECT_EQ(result.model.noise.read_sigma, expected.model.noise.read_sigma);
        }
}

TEST(Robust, NoiseBelowZeroIsAnErrorThatNamesIt) {
    PhotometricStereoOptions options;
    options.model.noise = NoiseModel{0, -1, 0};
    try {
        options.validate();
        FAIL();
    } catch (const InputError& error) {
        EXPECT_NE(std::string(error.what()).find("shot_gain"), std::string::npos);
    }
}

}  // namespace
}  // namespace darkbox
