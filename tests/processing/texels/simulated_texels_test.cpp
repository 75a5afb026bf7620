// Texels against the materials that the simulated textures are made of.

#include <gtest/gtest.h>

#include <opencv2/core.hpp>

#include "processing/texels/texels.h"
#include "rig/description/rig_description.h"
#include "sim/renderer.h"
#include "sim/scenes.h"
#include "tests/support/rand_index.h"

namespace darkbox {
namespace {

struct TrueTexels {
    AlbedoMap albedo;
    std::vector<int> material;  ///< of each valid pixel, in reading order
};

TrueTexels true_texels(const std::string& scene_name) {
    RigDescription rig = parse_rig(simulated_rig_toml(3), "simulated rig");
    rig.sim.scene = scene_name;
    rig.sim.width = 320;
    rig.sim.height = 240;
    const sim::SceneTruth truth = sim::render_truth(sim::scene_by_name(rig.sim, rig.lamps, *rig.ball_diameter_mm));
    TrueTexels texels{{cv::Mat3f(240, 320, cv::Vec3f::all(0)), cv::Mat1b(240, 320, uchar{0})}, {}};
    for (int y = 0; y < 240; ++y)
        for (int x = 0; x < 320; ++x) {
            const int material = truth.materials[static_cast<std::size_t>(y * 320 + x)];
            if (material == 0) continue;
            const float* rgb = truth.albedo.pixel(x, y);
            texels.albedo.albedo(y, x) = {rgb[0], rgb[1], rgb[2]};
            texels.albedo.valid(y, x) = 255;
            texels.material.push_back(material);
        }
    return texels;
}

std::vector<int> labels_of(const TexelResult& result) {
    std::vector<int> labels;
    for (const std::uint16_t label : result.index.label)
        if (label != 0) labels.push_back(label);
    return labels;
}

/// Of the same colours, in the same number of groups, as OpenCV parts them; the mean of ten seeds.
double rand_index_of_opencv(const TrueTexels& truth, int clusters) {
    cv::Mat1f points(static_cast<int>(truth.material.size()), 3);
    int row = 0;
    for (int y = 0; y < truth.albedo.valid.rows; ++y)
        for (int x = 0; x < truth.albedo.valid.cols; ++x)
            if (truth.albedo.valid(y, x)) std::copy_n(truth.albedo.albedo(y, x).val, 3, points[row++]);
    double sum = 0;
    for (int seed = 1; seed <= 10; ++seed) {
        cv::setRNGSeed(seed);
        cv::Mat1i labels;
        cv::kmeans(points, clusters, labels, {cv::TermCriteria::COUNT, 30, 0}, 1, cv::KMEANS_PP_CENTERS);
        sum += test::adjusted_rand_index({labels.begin(), labels.end()}, truth.material);
    }
    return sum / 10;
}

double rand_index(const TrueTexels& truth, int clusters) {
    double sum = 0;
    for (std::uint64_t seed = 1; seed <= 10; ++seed) {
        TexelOptions options;
        options.albedo_clusters = clusters;
        options.neighbourhood_clusters = 1;
        options.seed = seed;
        sum += test::adjusted_rand_index(labels_of(cluster_texels(truth.albedo, options)), truth.material);
    }
    return sum / 10;
}

struct Expected {
    const char* scene;
    int materials;
    double least;
};

class Materials : public testing::TestWithParam<Expected> {};

TEST_P(Materials, AreToldApartAsWellAsByOpenCv) {
    const auto& [scene, materials, least] = GetParam();
    const TrueTexels truth = true_texels(scene);
    const double ours = rand_index(truth, materials);
    const double theirs = rand_index_of_opencv(truth, materials);
    RecordProperty("darkbox", std::to_string(ours));
    RecordProperty("opencv", std::to_string(theirs));
    EXPECT_GE(ours, least);
    EXPECT_GE(ours, theirs - 0.005);
}

// Moss is of many greens, some as dark as stone: two colours do not part it.
INSTANTIATE_TEST_SUITE_P(Simulated, Materials,
                         testing::Values(Expected{"torus-brick", 2, 0.9}, Expected{"teapot-speckle", 3, 0.78},
                                         Expected{"sphere-marble", 2, 0.82}, Expected{"sphere-moss", 2, 0.27}),
                         [](const auto& scene) {
                             std::string name = scene.param.scene;
                             std::erase(name, '-');
                             return name;
                         });

TEST(RandIndex, IsOneForTheSamePartsAndNaughtForChance) {
    EXPECT_DOUBLE_EQ(test::adjusted_rand_index({1, 1, 2, 2, 3}, {7, 7, 5, 5, 9}), 1.0);
    // Two halves crossed: 2 of 6 pairs in each, none in both; chance expects 2/3.
    EXPECT_DOUBLE_EQ(test::adjusted_rand_index({1, 1, 2, 2}, {1, 2, 1, 2}), (0 - 2.0 / 3) / (2 - 2.0 / 3));
}

}  // namespace
}  // namespace darkbox
