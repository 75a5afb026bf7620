#include "processing/transfer/source_search.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "acquisition/frame/error.h"
#include "processing/transfer/measures.h"
#include "processing/transfer/pyramid.h"
#include "processing/transfer/synthesis.h"
#include "tests/processing/transfer/exemplars.h"

namespace darkbox {
namespace {

constexpr float anywhere = std::numeric_limits<float>::infinity();

/// Two levels of a pair, the coarser one synthesised: what the finer one's search is asked about.
struct Pair {
    Pair()
        : source(map_pyramid(level_of(stones.normals, stones.albedo.albedo), 2)),
          target(map_pyramid(level_of(waves, cv::Mat3f(waves.valid.size(), cv::Vec3f(0, 0, 0))), 2)),
          space(TransferOptions{}, 1.0F, {0.4F, 0.3F, 0.2F}) {
        const cv::Mat2i coarse =
            synthesise_level({source[1], nullptr, target[1], nullptr, {}, 0}, space, {true, 1}, [](int) {});
        synthesise_level({source[0], &source[1], target[0], &target[1], coarse, 0}, space, {true, 1}, [](int) {});
    }

    static MapLevel level_of(const NormalMap& normals, const cv::Mat3f& albedo) {
        return {normals.normal, albedo, normals.valid};
    }

    Candidate by(const SourceSearch& search, cv::Point p) const {
        Feature feature;
        space.read_target(target[0], &target[1], p, feature);
        SourceSearch::Scratch scratch;
        return search.nearest(feature, anywhere, scratch);
    }

    TransferSource stones = test::stony_sphere(64);
    NormalMap waves = test::wavy_normals({48, 48});
    MapPyramid source, target;
    FeatureSpace space;
};

TEST(SourceSearch, TheExactOneFindsTheNearest) {
    const Pair pair;
    const SourceSearch exact(pair.source[0], &pair.source[1], pair.space, true, 1);
    Feature asked, other;
    for (const cv::Point p : {cv::Point(0, 0), cv::Point(47, 3), cv::Point(20, 31), cv::Point(47, 47)}) {
        pair.space.read_target(pair.target[0], &pair.target[1], p, asked);
        double nearest = 1e9, at_found = 1e9;
        const Candidate found = pair.by(exact, p);
        for (int y = 0; y < 64; ++y)
            for (int x = 0; x < 64; ++x) {
                if (!pair.source[0].has({x, y})) continue;
                pair.space.read_source(pair.source[0], &pair.source[1], {x, y}, other);
                double sum = 0;
                for (std::size_t i = 0; i < asked.value.size(); ++i)
                    sum += asked.known[i] * std::pow(double{asked.value[i]} - double{other.value[i]}, 2);
                nearest = std::min(nearest, sum);
                if (found.source == cv::Point(x, y)) at_found = sum;
            }
        EXPECT_NEAR(at_found, nearest, 1e-5 * nearest) << p;
        EXPECT_NEAR(found.distance, at_found, 1e-5 * nearest) << p;
    }
}

TEST(SourceSearch, ShortListsAreNearlyExact) {
    const Pair pair;
    const SourceSearch exact(pair.source[0], &pair.source[1], pair.space, true, 1);
    const SourceSearch listed(pair.source[0], &pair.source[1], pair.space, false, 1);
    int all = 0, same = 0;
    double exact_sum = 0, listed_sum = 0;
    for (int y = 0; y < 48; ++y)
        for (int x = 0; x < 48; ++x) {
            const Candidate truth = pair.by(exact, {x, y}), found = pair.by(listed, {x, y});
            EXPECT_LE(truth.distance, found.distance);
            ++all;
            same += found.source == truth.source || found.distance == truth.distance;
            exact_sum += std::sqrt(double{truth.distance});
            listed_sum += std::sqrt(double{found.distance});
        }
    RecordProperty("same_percent", std::to_string(100.0 * same / all));
    RecordProperty("distance_ratio", std::to_string(listed_sum / exact_sum));
    EXPECT_GT(same, 0.90 * all);
    EXPECT_LT(listed_sum, 1.01 * exact_sum);
}

TEST(SourceSearch, AnalogiesWithShortListsAreAsGoodAsExactOnes) {
    const TransferSource source = test::stony_sphere(64);
    const NormalMap target = test::wavy_normals({64, 64});
    const Appearance shown = appearance_of(source.normals, source.albedo, 1);
    TransferOptions options = test::by(TransferMethod::analogies);
    options.passes = 0;  // the matches as they are
    const cv::Mat2i listed = transfer_texture(source, target, options).coordinates;
    options.exact_search = true;
    const cv::Mat2i exact = transfer_texture(source, target, options).coordinates;
    const auto energy = [&](const cv::Mat2i& coordinates) {
        return measure_coordinates(shown, target, coordinates, {.stride = 1}).joint_energy.value();
    };
    RecordProperty("joint_energy_ratio", std::to_string(energy(listed) / energy(exact)));
    EXPECT_FALSE(test::equal(listed, exact));  // or the option does nothing
    EXPECT_LT(energy(listed), 1.05 * energy(exact));
    EXPECT_TRUE(test::equal(exact, test::transferred_on(8, source, target, options).coordinates));
}

TEST(SourceSearch, IsExactForAnalogiesOnly) {
    TransferOptions options = test::by(TransferMethod::patchmatch);
    options.exact_search = true;
    EXPECT_THROW(options.validate(), InputError);
}

}  // namespace
}  // namespace darkbox
