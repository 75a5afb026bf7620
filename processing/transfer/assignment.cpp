#include "processing/transfer/assignment.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "processing/transfer/kd_tree.h"

namespace darkbox {
namespace {

constexpr std::size_t coverage_samples = 4096;
constexpr double degrees = 180 / std::numbers::pi;

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

double percentile95(std::vector<double>& values) {
    std::sort(values.begin(), values.end());
    const double position = 0.95 * static_cast<double>(values.size() - 1);
    const auto below = static_cast<std::size_t>(position);
    const std::size_t above = std::min(below + 1, values.size() - 1);
    const double fraction = position - static_cast<double>(below);
    return values[below] * (1 - fraction) + values[above] * fraction;
}

/// Calls `visit(p, q)` for each pair of neighbours, q right of or below p.
template <class Visit>
void for_each_pair(const cv::Mat1b& valid, const Visit& visit) {
    for (int y = 0; y < valid.rows; ++y)
        for (int x = 0; x < valid.cols; ++x) {
            if (!valid(y, x)) continue;
            if (x + 1 < valid.cols && valid(y, x + 1)) visit(cv::Point(x, y), cv::Point(x + 1, y));
            if (y + 1 < valid.rows && valid(y + 1, x)) visit(cv::Point(x, y), cv::Point(x, y + 1));
        }
}

double mean_square(const cv::Vec3b& a, const cv::Vec3b& b) {
    const cv::Vec3i difference = cv::Vec3i(a) - cv::Vec3i(b);
    return difference.dot(difference) / 3.0;
}

}  // namespace

std::optional<double> seam(const Appearance& source, const cv::Mat1b& target, const cv::Mat2i& coordinates) {
    const cv::Mat3b& picture = source.picture;
    const auto near = [&](cv::Point p) -> const cv::Vec3b& {
        return picture(std::clamp(p.y, 0, picture.rows - 1), std::clamp(p.x, 0, picture.cols - 1));
    };
    std::size_t pairs = 0;
    double sum = 0;
    for_each_pair(target, [&](cv::Point p, cv::Point q) {
        const cv::Point a(coordinates(p));
        const cv::Point b(coordinates(q));
        ++pairs;
        sum += std::sqrt((mean_square(near(a + q - p), near(b)) + mean_square(near(b - q + p), near(a))) / 2);
    });
    if (pairs == 0) return std::nullopt;
    return sum / static_cast<double>(pairs);
}

std::optional<AngleMeasure> angles(const NormalMap& source, const NormalMap& target, const cv::Mat2i& coordinates) {
    std::vector<double> angles;
    double sum = 0;
    for (const cv::Point& p : pixels_of(target.valid)) {
        const cv::Point q(coordinates(p));
        if (!source.valid(q)) continue;
        const auto cosine = static_cast<double>(source.normal(q).dot(target.normal(p)));
        angles.push_back(std::acos(std::clamp(cosine, -1.0, 1.0)) * degrees);
        sum += angles.back();
    }
    if (angles.empty()) return std::nullopt;
    const double mean = sum / static_cast<double>(angles.size());
    return AngleMeasure{mean, percentile95(angles)};
}

double cover(const cv::Mat1b& source, const cv::Mat1b& target, const cv::Mat2i& coordinates) {
    cv::Mat1b used(source.size(), std::uint8_t{0});
    for (const cv::Point& p : pixels_of(target)) {
        const cv::Point q(coordinates(p));
        if (source(q)) used(q) = 255;
    }
    return static_cast<double>(cv::countNonZero(used)) / std::max(1, cv::countNonZero(source));
}

int background(const cv::Mat1b& source, const cv::Mat1b& target, const cv::Mat2i& coordinates) {
    int hits = 0;
    for (const cv::Point& p : pixels_of(target))
        if (!source(cv::Point(coordinates(p)))) ++hits;
    return hits;
}

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
        angles.push_back(2 * std::asin(std::min(1.0, chord / 2)) * degrees);
    }
    return percentile95(angles);
}

double coherence(const cv::Mat2i& coordinates) {
    std::size_t pairs = 0;
    std::size_t coherent = 0;
    cv::Mat1b inside(coordinates.size());
    for (int y = 0; y < inside.rows; ++y)
        for (int x = 0; x < inside.cols; ++x) inside(y, x) = coordinates(y, x)[0] < 0 ? 0 : 255;
    for_each_pair(inside, [&](cv::Point p, cv::Point q) {
        ++pairs;
        if (cv::Point(coordinates(q)) - cv::Point(coordinates(p)) == q - p) ++coherent;
    });
    return pairs == 0 ? 1.0 : static_cast<double>(coherent) / static_cast<double>(pairs);
}

}  // namespace darkbox
