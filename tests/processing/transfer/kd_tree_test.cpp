#include "processing/transfer/kd_tree.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "processing/texels/random.h"

namespace darkbox {
namespace {

constexpr float at_any_distance = std::numeric_limits<float>::infinity();
constexpr int all_leaves = std::numeric_limits<int>::max();

PointSet random_points(std::size_t count, std::size_t dimensions, std::uint64_t seed) {
    SplitMix64 random(seed);
    PointSet points{dimensions, {}};
    for (std::size_t i = 0; i < count * dimensions; ++i)
        points.coordinates.push_back(static_cast<float>(random.uniform()));
    return points;
}

std::vector<Match> by_brute_force(const PointSet& points, const float* query, std::size_t count) {
    std::vector<Match> all;
    for (std::size_t i = 0; i < points.size(); ++i) {
        float sum = 0;
        for (std::size_t d = 0; d < points.dimensions; ++d) {
            const float difference = points[i][d] - query[d];
            sum += difference * difference;
        }
        all.push_back({static_cast<int>(i), sum});
    }
    std::sort(all.begin(), all.end(),
              [](const Match& a, const Match& b) { return a.squared_distance < b.squared_distance; });
    all.resize(std::min(count, all.size()));
    return all;
}

std::vector<int> numbers(const std::vector<Match>& matches) {
    std::vector<int> result;
    for (const Match& match : matches) result.push_back(match.point);
    return result;
}

class KdTreeAgainstBruteForce : public testing::TestWithParam<std::size_t> {};

TEST_P(KdTreeAgainstBruteForce, WithoutALimitItIsExact) {
    const PointSet points = random_points(GetParam(), 5, 11);
    const PointSet queries = random_points(50, 5, 12);
    const KdTree tree(points);
    std::vector<Match> matches;
    for (std::size_t i = 0; i < queries.size(); ++i) {
        tree.nearest(queries[i], 4, at_any_distance, all_leaves, matches);
        EXPECT_EQ(numbers(matches), numbers(by_brute_force(points, queries[i], 4)));
    }
}

INSTANTIATE_TEST_SUITE_P(Sizes, KdTreeAgainstBruteForce, testing::Values(1, 3, 16, 17, 33, 1000));

TEST(KdTree, FindsNothingBeyondTheRadius) {
    const PointSet points{1, {0, 1, 2, 3, 4}};
    const KdTree tree(points);
    std::vector<Match> matches;
    const float query = 2.1F;
    tree.nearest(&query, 5, 1.0F, all_leaves, matches);
    EXPECT_EQ(numbers(matches), (std::vector{2, 3}));
    tree.nearest(&query, 5, 0.0F, all_leaves, matches);
    EXPECT_TRUE(matches.empty());
}

TEST(KdTree, HoldsManyEqualPoints) {
    const PointSet points{2, std::vector<float>(2 * 500, 0.25F)};
    const KdTree tree(points);
    std::vector<Match> matches;
    const float query[] = {0.25F, 0.25F};
    tree.nearest(query, 3, at_any_distance, all_leaves, matches);
    ASSERT_EQ(matches.size(), 3U);
    EXPECT_EQ(matches.front().squared_distance, 0.0F);
}

TEST(KdTree, FewLeavesAreNearlyExactInManyDimensions) {
    const PointSet points = random_points(20000, 8, 21);
    const PointSet queries = random_points(200, 8, 22);
    const KdTree tree(points);
    std::vector<Match> matches;
    double ratio = 0;
    for (std::size_t i = 0; i < queries.size(); ++i) {
        tree.nearest(queries[i], 1, at_any_distance, 64, matches);
        ratio += std::sqrt(matches.front().squared_distance /
                           by_brute_force(points, queries[i], 1).front().squared_distance);
    }
    EXPECT_LT(ratio / 200, 1.02);
}

}  // namespace
}  // namespace darkbox
