#include "processing/texels/texels.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <opencv2/core.hpp>
#include <set>

#include "acquisition/frame/error.h"

namespace darkbox {
namespace {

AlbedoMap filled(cv::Size size, const cv::Vec3f& colour) {
    return {cv::Mat3f(size, colour), cv::Mat1b(size, std::uint8_t{255})};
}

AlbedoMap textured_disc(int side) {
    AlbedoMap map{cv::Mat3f(side, side, cv::Vec3f(0, 0, 0)), cv::Mat1b(side, side, std::uint8_t{0})};
    cv::RNG random(11);
    for (int y = 0; y < side; ++y)
        for (int x = 0; x < side; ++x) {
            if (std::hypot(x - side / 2, y - side / 2) > 0.45 * side) continue;
            const float stripe = (x / 4 + y / 7) % 2 == 0 ? 0.2F : 0.7F;
            const auto grain = static_cast<float>(random.gaussian(0.03));
            map.albedo(y, x) = cv::Vec3f(stripe + grain, 0.5F * stripe + grain, 0.3F + grain);
            map.valid(y, x) = 255;
        }
    return map;
}

std::set<int> label_set_of(const IndexMap& index) { return {index.label.begin(), index.label.end()}; }

TEST(ClusterTexels, LabelsHaveNoGapsAndAreZeroOutside) {
    const AlbedoMap disc = textured_disc(120);
    const TexelResult result = cluster_texels(disc);
    std::set<int> labels = label_set_of(result.index);
    EXPECT_EQ(*labels.begin(), 0);
    EXPECT_EQ(*labels.rbegin(), result.index.texels);
    EXPECT_EQ(static_cast<int>(labels.size()), result.index.texels + 1);
    EXPECT_EQ(result.index.texels, 64);
    for (int y = 0; y < 120; ++y)
        for (int x = 0; x < 120; ++x) ASSERT_EQ(result.index.label(y, x) != 0, disc.valid(y, x) != 0);
}

TEST(ClusterTexels, StatesTheVarianceWithinAndExplained) {
    AlbedoMap map = filled({4, 1}, {0, 0, 0});
    map.albedo(0, 1) = {0.2F, 0, 0};
    map.albedo(0, 2) = {0.8F, 0, 0};
    map.albedo(0, 3) = {1.0F, 0, 0};
    TexelOptions options;
    options.albedo_clusters = 2;
    options.neighbourhood_clusters = 1;
    const TexelResult result = cluster_texels(map, options);
    EXPECT_EQ(result.index.texels, 2);
    EXPECT_NEAR(result.within_cluster_variance, 0.01, 1e-7);
    EXPECT_NEAR(result.variance_explained, 1 - 0.01 / 0.17, 1e-6);
}

TEST(ClusterTexels, EqualColoursInUnequalSurroundingsAreApart) {
    // A dark field with a bright left half: dark pixels by the seam see other neighbours than those deep inside.
    AlbedoMap map = filled({40, 20}, {0.1F, 0.1F, 0.1F});
    map.albedo(cv::Rect(0, 0, 20, 20)).setTo(cv::Scalar(0.9, 0.9, 0.9));
    TexelOptions options;
    options.albedo_clusters = 2;
    options.neighbourhood_clusters = 2;
    const TexelResult result = cluster_texels(map, options);
    EXPECT_EQ(result.index.texels, 4);
    EXPECT_NE(result.index.label(10, 20), result.index.label(10, 35));
    EXPECT_EQ(result.index.label(10, 30), result.index.label(10, 35));
}

TEST(ClusterTexels, NothingLeaksInFromOutsideTheMask) {
    AlbedoMap dark = textured_disc(80);
    AlbedoMap bright = textured_disc(80);
    bright.albedo.setTo(cv::Scalar(9, 9, 9), bright.valid == 0);
    EXPECT_EQ(cv::norm(cluster_texels(dark).index.label, cluster_texels(bright).index.label, cv::NORM_INF), 0);
}

TEST(ClusterTexels, FewerColoursThanClustersMakeFewerTexels) {
    EXPECT_EQ(cluster_texels(filled({30, 20}, {0.5F, 0.4F, 0.3F})).index.texels, 1);
    EXPECT_EQ(cluster_texels(filled({30, 20}, {0.5F, 0.4F, 0.3F})).variance_explained, 1.0);
}

TEST(ClusterTexels, OnePixelIsOneTexel) {
    AlbedoMap map = filled({9, 9}, {0.5F, 0.4F, 0.3F});
    map.valid.setTo(0);
    map.valid(4, 4) = 255;
    const TexelResult result = cluster_texels(map);
    EXPECT_EQ(result.index.texels, 1);
    EXPECT_EQ(cv::countNonZero(result.index.label), 1);
    EXPECT_EQ(result.index.label(4, 4), 1);
}

std::vector<int> sizes_of(const IndexMap& index) {
    std::vector<int> sizes(index.texels, 0);
    for (const std::uint16_t label : index.label)
        if (label != 0) ++sizes[label - 1];
    return sizes;
}

TEST(ClusterTexels, SmallTexelsJoinAndLargeOnesArePartedWithinTheLimits) {
    const AlbedoMap disc = textured_disc(120);
    TexelOptions options;
    options.min_pixels = 60;
    options.max_pixels = 200;
    const std::vector<int> free = sizes_of(cluster_texels(disc).index);
    ASSERT_LT(*std::min_element(free.begin(), free.end()), 60);
    ASSERT_GT(*std::max_element(free.begin(), free.end()), 200);
    const TexelResult limited = cluster_texels(disc, options);
    const std::vector<int> sizes = sizes_of(limited.index);
    EXPECT_GE(*std::min_element(sizes.begin(), sizes.end()), 60);
    EXPECT_EQ(std::accumulate(sizes.begin(), sizes.end(), 0), cv::countNonZero(disc.valid));
    options.min_pixels = 1;
    const std::vector<int> parted = sizes_of(cluster_texels(disc, options).index);
    EXPECT_LE(*std::max_element(parted.begin(), parted.end()), 200);
}

TEST(ClusterTexels, ASmallTexelJoinsTheMostAlike) {
    AlbedoMap map = filled({30, 10}, {0.1F, 0.1F, 0.1F});
    map.albedo(cv::Rect(10, 0, 10, 10)).setTo(cv::Scalar::all(0.9));
    map.albedo(cv::Rect(20, 0, 10, 10)).setTo(cv::Scalar(0.5, 0, 0));
    map.albedo(5, 5) = {0.8F, 0.8F, 0.8F};
    TexelOptions options;
    options.albedo_clusters = 4;
    options.neighbourhood_clusters = 1;
    ASSERT_EQ(cluster_texels(map, options).index.texels, 4);
    options.min_pixels = 2;
    const IndexMap joined = cluster_texels(map, options).index;
    EXPECT_EQ(joined.texels, 3);
    EXPECT_EQ(joined.label(5, 5), joined.label(0, 15));
}

TEST(ClusterTexels, AnObjectBelowTheLimitIsOneTexel) {
    TexelOptions options;
    options.min_pixels = 100000;
    EXPECT_EQ(cluster_texels(textured_disc(40), options).index.texels, 1);
}

TEST(ClusterTexels, EqualWindowsAreNotPartedWhateverTheLimit) {
    TexelOptions options;
    options.max_pixels = 10;
    EXPECT_EQ(cluster_texels(filled({30, 20}, {0.5F, 0.4F, 0.3F}), options).index.texels, 1);
}

TEST(ClusterTexels, PixelsThatAreNotNumbersAreOutside) {
    AlbedoMap map = textured_disc(60);
    map.albedo(30, 30) = {0.5F, std::nanf(""), 0.5F};
    map.albedo(31, 30)[0] = std::numeric_limits<float>::infinity();
    const TexelResult result = cluster_texels(map);
    EXPECT_EQ(result.index.label(30, 30), 0);
    EXPECT_EQ(result.index.label(31, 30), 0);
    EXPECT_NE(result.index.label(30, 31), 0);
    EXPECT_TRUE(std::isfinite(result.within_cluster_variance));
}

TEST(ClusterTexels, SameBitsOnAnyNumberOfThreads) {
    const AlbedoMap disc = textured_disc(200);
    WorkContext work;
    work.threads = 1;
    const TexelResult one = cluster_texels(disc, {}, work);
    for (const int threads : {2, 8}) {
        work.threads = threads;
        const TexelResult many = cluster_texels(disc, {}, work);
        EXPECT_EQ(cv::norm(one.index.label, many.index.label, cv::NORM_INF), 0);
        EXPECT_EQ(one.within_cluster_variance, many.within_cluster_variance);
    }
}

TEST(ClusterTexels, MoreClustersExplainMore) {
    const AlbedoMap disc = textured_disc(120);
    TexelOptions few;
    few.albedo_clusters = 2;
    EXPECT_LT(cluster_texels(disc, few).variance_explained, cluster_texels(disc).variance_explained);
    EXPECT_GT(cluster_texels(disc).variance_explained, 0.98);
}

TEST(ClusterTexels, ASeedGivesOneResult) {
    const AlbedoMap disc = textured_disc(90);
    EXPECT_EQ(cv::norm(cluster_texels(disc).index.label, cluster_texels(disc).index.label, cv::NORM_INF), 0);
}

TEST(ClusterTexels, RefusesAnEmptyMap) {
    EXPECT_THROW(cluster_texels({}), InputError);
    AlbedoMap none = filled({5, 5}, {1, 1, 1});
    none.valid.setTo(0);
    EXPECT_THROW(cluster_texels(none), InputError);
    AlbedoMap unequal{cv::Mat3f(5, 5), cv::Mat1b(4, 5)};
    EXPECT_THROW(cluster_texels(unequal), InputError);
}

TEST(ClusterTexels, StopsWhenAsked) {
    std::stop_source stop;
    stop.request_stop();
    WorkContext work;
    work.stop = stop.get_token();
    EXPECT_THROW(cluster_texels(textured_disc(60), {}, work), Cancelled);
}

TEST(TexelOptions, NameTheFieldAndItsRange) {
    const auto message = [](const TexelOptions& options) -> std::string {
        try {
            options.validate();
        } catch (const InputError& error) {
            return error.what();
        }
        return {};
    };
    TexelOptions even;
    even.window = 4;
    EXPECT_THAT(message(even), testing::HasSubstr("window is 4"));
    TexelOptions none;
    none.albedo_clusters = 0;
    EXPECT_THAT(message(none), testing::HasSubstr("albedo_clusters is 0, allowed are 1...256"));
    TexelOptions crossed;
    crossed.min_pixels = 20;
    crossed.max_pixels = 10;
    EXPECT_THAT(message(crossed), testing::HasSubstr("max_pixels is 10, less than min_pixels, 20"));
    TexelOptions many;
    many.albedo_clusters = many.neighbourhood_clusters = 256;
    EXPECT_THAT(message(many), testing::HasSubstr("65536"));
    EXPECT_EQ(message({}), "");
}

}  // namespace
}  // namespace darkbox
