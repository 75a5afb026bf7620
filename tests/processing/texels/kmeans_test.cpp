#include "processing/texels/kmeans.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <set>

#include "processing/maps/parallel.h"

namespace darkbox {
namespace {

cv::Mat1f blobs(int per_blob, const std::vector<cv::Vec2f>& centres, float sigma) {
    cv::RNG random(7);
    cv::Mat1f points(per_blob * static_cast<int>(centres.size()), 2);
    for (int i = 0; i < points.rows; ++i)
        for (int d = 0; d < 2; ++d)
            points(i, d) = centres[i / per_blob][d] + static_cast<float>(random.gaussian(sigma));
    return points;
}

cv::Mat1f noise(int rows, int cols) {
    cv::Mat1f points(rows, cols);
    cv::theRNG().state = 3;
    cv::randu(points, 0.0F, 1.0F);
    return points;
}

TEST(KMeans, FindsSeparateBlobs) {
    const std::vector<cv::Vec2f> truth{{0, 0}, {10, 0}, {0, 10}, {10, 10}, {5, 20}};
    const cv::Mat1f points = blobs(700, truth, 0.5F);
    const KMeansResult result = kmeans(MatrixPoints(points), {5, 50, 1});
    ASSERT_EQ(result.centres.rows, 5);
    for (const cv::Vec2f& centre : truth) {
        double nearest = 1e9;
        for (int c = 0; c < 5; ++c)
            nearest = std::min(nearest, cv::norm(cv::Vec2f(result.centres(c, 0), result.centres(c, 1)) - centre));
        EXPECT_LT(nearest, 0.1);
    }
    for (int i = 0; i < points.rows; ++i) EXPECT_EQ(result.label[i], result.label[i / 700 * 700]);
}

TEST(KMeans, InertiaIsTheSumOfSquaredDistances) {
    const cv::Mat1f points = (cv::Mat1f(4, 1) << 0, 2, 10, 14);
    EXPECT_DOUBLE_EQ(kmeans(MatrixPoints(points), {2, 10, 1}).inertia, 1 + 1 + 4 + 4);
    EXPECT_DOUBLE_EQ(kmeans(MatrixPoints(points), {4, 10, 1}).inertia, 0);
}

TEST(KMeans, EqualPointsMakeOneClusterEach) {
    cv::Mat1f points(3000, 3);
    for (int i = 0; i < points.rows; ++i) points.row(i).setTo(0.1F * static_cast<float>(i % 3) + 0.7F);
    const KMeansResult result = kmeans(MatrixPoints(points), {8, 30, 1});
    EXPECT_EQ(result.centres.rows, 3);
    EXPECT_EQ(std::set<int>(result.label.begin(), result.label.end()).size(), 3U);
    EXPECT_LT(result.inertia, 1e-9);
}

TEST(KMeans, EveryClusterHasAPoint) {
    const cv::Mat1f few = noise(60, 2);
    for (std::uint64_t seed = 0; seed < 40; ++seed) {
        const KMeansResult result = kmeans(MatrixPoints(few), {50, 30, seed});
        EXPECT_EQ(std::set<int>(result.label.begin(), result.label.end()).size(), 50U);
    }
}

TEST(KMeans, SameBitsOnAnyNumberOfThreads) {
    const cv::Mat1f points = noise(20000, 27);
    const auto on = [&](int threads) {
        WorkContext work;
        work.threads = threads;
        return on_threads_of(work, [&] { return kmeans(MatrixPoints(points), {12, 20, 5}); });
    };
    const KMeansResult one = on(1);
    for (const int threads : {2, 8}) {
        const KMeansResult many = on(threads);
        EXPECT_EQ(one.label, many.label);
        EXPECT_EQ(cv::norm(one.centres, many.centres, cv::NORM_INF), 0);
        EXPECT_EQ(one.inertia, many.inertia);
    }
}

TEST(KMeans, EveryPointIsAtItsNearestMeanWhenNothingChanges) {
    // More points than the sample, run to the end: a wrong bound would leave a point at a centre that is not its
    // nearest.
    const cv::Mat1f points = noise(40000, 5);
    const KMeansResult result = kmeans(MatrixPoints(points), {30, 1000, 2});
    ASSERT_LT(result.iterations, 1000);
    cv::Mat1d sums(result.centres.rows, 5, 0.0);
    std::vector<int> count(result.centres.rows, 0);
    for (int i = 0; i < points.rows; ++i) {
        const double own = cv::norm(points.row(i), result.centres.row(result.label[i]));
        for (int c = 0; c < result.centres.rows; ++c)
            ASSERT_LE(own, cv::norm(points.row(i), result.centres.row(c)) + 1e-5);
        for (int d = 0; d < 5; ++d) sums(result.label[i], d) += points(i, d);
        ++count[result.label[i]];
    }
    for (int c = 0; c < result.centres.rows; ++c)
        for (int d = 0; d < 5; ++d) EXPECT_NEAR(result.centres(c, d), sums(c, d) / count[c], 1e-5);
}

TEST(KMeans, FarFromTheOriginItIsAsGood) {
    const cv::Mat1f points = noise(3000, 4);
    const cv::Mat1f far(points + 1000.0F);
    const double here = kmeans(MatrixPoints(points), {9, 30, 1}).inertia;
    EXPECT_NEAR(kmeans(MatrixPoints(far), {9, 30, 1}).inertia / here, 1.0, 1e-3);
}

TEST(KMeans, FewDifferentPointsAmongManyAreAllFound) {
    cv::Mat1f points(50000, 3, 0.25F);
    for (int i = 0; i < 6; ++i) points.row(7000 * i + 13).setTo(static_cast<float>(i));
    EXPECT_EQ(kmeans(MatrixPoints(points), {8, 30, 1}).centres.rows, 7);
}

/// Inertia over the same seeds, k and number of iterations: one run of k-means is a matter of luck.
double mean_ratio_to_opencv(const cv::Mat1f& points) {
    double ours = 0;
    double theirs = 0;
    for (int seed = 1; seed <= 10; ++seed) {
        ours += kmeans(MatrixPoints(points), {16, 30, static_cast<std::uint64_t>(seed)}).inertia;
        cv::setRNGSeed(seed);
        cv::Mat labels;
        theirs += cv::kmeans(points, 16, labels, {cv::TermCriteria::COUNT, 30, 0}, 1, cv::KMEANS_PP_CENTERS);
    }
    return ours / theirs;
}

TEST(KMeans, NoWorseThanOpenCv) {
    std::vector<cv::Vec2f> centres;
    for (float i = 0; i < 20; ++i) centres.emplace_back(std::cos(0.7F * i) * i, std::sin(1.1F * i) * i);
    const double on_blobs = mean_ratio_to_opencv(blobs(200, centres, 0.8F));
    const double on_noise = mean_ratio_to_opencv(noise(4000, 3));
    RecordProperty("on_blobs", std::to_string(on_blobs));
    RecordProperty("on_noise", std::to_string(on_noise));
    EXPECT_LE(on_blobs, 1.0);
    EXPECT_LE(on_noise, 1.005);
}

}  // namespace
}  // namespace darkbox
