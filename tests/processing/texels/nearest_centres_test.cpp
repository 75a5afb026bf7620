#include "processing/texels/nearest_centres.h"

#include <gtest/gtest.h>

#include <limits>
#include <opencv2/core.hpp>

namespace darkbox {
namespace {

cv::Mat1f drawn(int rows, int cols, int seed) {
    cv::Mat1f values(rows, cols);
    cv::RNG random(seed);
    random.fill(values, cv::RNG::NORMAL, 0, 1);
    return values;
}

/// Half the squared distance without |p|^2 / 2, in double.
double score(const float* point, const float* centre, int dimensions) {
    double sum = 0;
    for (int d = 0; d < dimensions; ++d) sum += centre[d] * (0.5 * centre[d] - point[d]);
    return sum;
}

class EverySize : public testing::TestWithParam<std::tuple<int, int, int>> {};

TEST_P(EverySize, FindsTheNearestAndTheScoreOfTheNext) {
    const auto [count, clusters, dimensions] = GetParam();
    const cv::Mat1f points = drawn(count, dimensions, 3);
    const cv::Mat1f centres = drawn(clusters, dimensions, 4);
    std::vector<NearestCentres::Found> found(count);
    NearestCentres(centres).find(points[0], found.size(), found.data());
    for (int i = 0; i < count; ++i) {
        std::vector<double> scores;
        for (int c = 0; c < clusters; ++c) scores.push_back(score(points[i], centres[c], dimensions));
        EXPECT_NEAR(scores[found[i].centre], *std::min_element(scores.begin(), scores.end()), 1e-4);
        EXPECT_NEAR(found[i].score, scores[found[i].centre], 1e-4);
        scores.erase(scores.begin() + found[i].centre);
        if (clusters == 1)
            EXPECT_EQ(found[i].second, std::numeric_limits<float>::max());
        else
            EXPECT_NEAR(found[i].second, *std::min_element(scores.begin(), scores.end()), 1e-4);
    }
}

INSTANTIATE_TEST_SUITE_P(NearestCentres, EverySize,
                         testing::Combine(testing::Values(1, 7, 50), testing::Values(1, 2, 8, 9, 16, 17, 70),
                                          testing::Values(1, 3, 75)));

TEST(NearestCentres, ATieGoesToTheFirst) {
    cv::Mat1f centres(40, 2);
    for (int c = 0; c < 40; ++c) centres.row(c).setTo(c < 11 ? 5.0F : 1.0F);  // 11...39 are equal
    const float point[2] = {0, 0};
    NearestCentres::Found found;
    NearestCentres(centres).find(point, 1, &found);
    EXPECT_EQ(found.centre, 11);
    EXPECT_EQ(found.second, found.score);
}

}  // namespace
}  // namespace darkbox
