#include "processing/transfer/measures.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "processing/transfer/nearest.h"

namespace darkbox {
namespace {

constexpr int quantiles = 257;
constexpr std::size_t coverage_samples = 4096;
constexpr std::size_t patch_samples = 1024;

std::vector<cv::Point> pixels_of(const cv::Mat1b& valid) {
    std::vector<cv::Point> pixels;
    cv::findNonZero(valid, pixels);
    return pixels;
}

/// Every n-th, so that about `count` are left.
std::vector<cv::Point> thinned(const std::vector<cv::Point>& pixels, std::size_t count) {
    std::vector<cv::Point> chosen;
    const std::size_t stride = std::max<std::size_t>(1, pixels.size() / count);
    for (std::size_t i = stride / 2; i < pixels.size(); i += stride) chosen.push_back(pixels[i]);
    return chosen;
}

template <class Number>
Number quantile(const std::vector<Number>& sorted, double share) {
    const double position = share * static_cast<double>(sorted.size() - 1);
    const auto below = static_cast<std::size_t>(position);
    const auto above = std::min(below + 1, sorted.size() - 1);
    const auto fraction = static_cast<Number>(position - static_cast<double>(below));
    return sorted[below] * (1 - fraction) + sorted[above] * fraction;
}

/// Pixels whose whole patch is valid.
std::vector<cv::Point> patch_centres(const cv::Mat1b& valid, int window) {
    cv::Mat1b inside;
    cv::erode(valid, inside, cv::Mat1b(window, window, std::uint8_t{1}), cv::Point(-1, -1), 1, cv::BORDER_CONSTANT,
              cv::Scalar(0));
    return pixels_of(inside);
}

void read_patch(const cv::Mat3f& albedo, cv::Point centre, int window, Feature& patch) {
    patch.value.clear();
    for (int dy = -(window / 2); dy <= window / 2; ++dy)
        for (int dx = -(window / 2); dx <= window / 2; ++dx) {
            const cv::Vec3f& v = albedo(centre.y + dy, centre.x + dx);
            patch.value.insert(patch.value.end(), v.val, v.val + 3);
        }
    patch.value.resize((patch.value.size() + 7) / 8 * 8, 0.0F);
    patch.known.assign(patch.value.size(), 1.0F);
}

/// The short list is the tree's: the exact nearest of it is within a fraction of a percent of the nearest of all.
double squared_distance_to_nearest(const NearestFeatures& nearest, const NearestFeatures::Reader& reader,
                                   const Feature& patch) {
    std::vector<float> query;
    std::vector<Match> matches;
    Feature other;
    float best = std::numeric_limits<float>::infinity();
    nearest.short_list(patch, best, query, matches);
    for (const Match& match : matches) {
        reader(static_cast<std::size_t>(match.point), other);
        best = std::min(best, squared_distance(patch, other));
    }
    return best;
}

std::vector<float> sorted_channel(const AlbedoMap& albedo, int channel) {
    std::vector<float> values;
    for (const cv::Point& p : pixels_of(albedo.valid)) values.push_back(albedo.albedo(p)[channel]);
    std::sort(values.begin(), values.end());
    return values;
}

}  // namespace

double coverage_deg(const NormalMap& source, const NormalMap& target) {
    PointSet points;
    points.dimensions = 3;
    for (const cv::Point& p : pixels_of(source.valid))
        points.coordinates.insert(points.coordinates.end(), source.normal(p).val, source.normal(p).val + 3);
    const KdTree tree(points);
    std::vector<double> angles;
    std::vector<Match> matches;
    for (const cv::Point& p : thinned(pixels_of(target.valid), coverage_samples)) {
        tree.nearest(target.normal(p).val, 1, std::numeric_limits<float>::infinity(), std::numeric_limits<int>::max(),
                     matches);
        const double chord = std::sqrt(static_cast<double>(matches.front().squared_distance));
        angles.push_back(2 * std::asin(std::min(1.0, chord / 2)) * 180 / std::numbers::pi);
    }
    std::sort(angles.begin(), angles.end());
    return quantile(angles, 0.95);
}

double coherence(const cv::Mat2i& coordinates) {
    std::size_t pairs = 0;
    std::size_t coherent = 0;
    const auto count = [&](const cv::Vec2i& here, const cv::Vec2i& there, const cv::Vec2i& step) {
        if (here[0] < 0 || there[0] < 0) return;
        ++pairs;
        if (there - here == step) ++coherent;
    };
    for (int y = 0; y < coordinates.rows; ++y)
        for (int x = 0; x < coordinates.cols; ++x) {
            if (x + 1 < coordinates.cols) count(coordinates(y, x), coordinates(y, x + 1), {1, 0});
            if (y + 1 < coordinates.rows) count(coordinates(y, x), coordinates(y + 1, x), {0, 1});
        }
    return pairs == 0 ? 1.0 : static_cast<double>(coherent) / static_cast<double>(pairs);
}

double patch_energy(const AlbedoMap& source, const AlbedoMap& target, int window, float white) {
    const std::vector<cv::Point> sources = patch_centres(source.valid, window);
    const std::vector<cv::Point> targets = thinned(patch_centres(target.valid, window), patch_samples);
    if (sources.empty() || targets.empty()) return 0;
    const auto reader = [&](std::size_t i, Feature& patch) { read_patch(source.albedo, sources[i], window, patch); };
    const NearestFeatures nearest(sources.size(), reader, 0);
    double sum = 0;
    Feature patch;
    for (const cv::Point& p : targets) {
        read_patch(target.albedo, p, window, patch);
        sum += squared_distance_to_nearest(nearest, reader, patch);
    }
    const double numbers = static_cast<double>(targets.size()) * 3 * window * window;
    return 255 / static_cast<double>(white) * std::sqrt(sum / numbers);
}

double histogram_distance(const AlbedoMap& source, const AlbedoMap& target, float white) {
    double sum = 0;
    for (int channel = 0; channel < 3; ++channel) {
        const std::vector<float> a = sorted_channel(source, channel);
        const std::vector<float> b = sorted_channel(target, channel);
        for (int i = 0; i < quantiles; ++i) {
            const double share = static_cast<double>(i) / (quantiles - 1);
            sum += std::abs(static_cast<double>(quantile(a, share)) - static_cast<double>(quantile(b, share)));
        }
    }
    return 255 / static_cast<double>(white) * sum / (3 * quantiles);
}

float white_level(const AlbedoMap& albedo) {
    std::vector<float> brightest;
    for (const cv::Point& p : pixels_of(albedo.valid)) {
        const cv::Vec3f& v = albedo.albedo(p);
        brightest.push_back(std::max({v[0], v[1], v[2]}));
    }
    std::sort(brightest.begin(), brightest.end());
    const float level = quantile(brightest, 0.99);
    return level > 0 ? level : 1.0F;
}

}  // namespace darkbox
