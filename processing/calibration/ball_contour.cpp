#include "processing/calibration/ball_contour.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "acquisition/frame/error.h"
#include "processing/calibration/edge_profile.h"
#include "processing/calibration/outline_fit.h"

namespace darkbox {
namespace {

constexpr double step_px = 0.5;
constexpr double blur_px = 0.8;           ///< applied to the picture before it is read
constexpr double read_blur_px = 0.85;     ///< of rough profiles: that and the pixels'
constexpr double margin_px = 2.0;         ///< of profile beyond the offsets that are tried
constexpr double least_significance = 4;  ///< standard deviations of noise that an edge explains
constexpr double floor_radiance = 1.0 / 1024;

struct Reading {
    cv::Point2d at;
    double strength = 0;  ///< the edge's height relative to the brightness there
    double height = 0;    ///< root mean square over the profile, as `noise`
    double noise = 0;
};

/// Weights of four neighbours for a value a fraction after the second (Catmull and Rom 1974): interpolation that hardly
/// blurs, and not by more halfway between pixels.
std::array<double, 4> cubic_weights(double f) {
    return {f * (-0.5 + f * (1 - 0.5 * f)), 1 + f * f * (-2.5 + 1.5 * f), f * (0.5 + f * (2 - 1.5 * f)),
            f * f * (-0.5 + 0.5 * f)};
}

std::optional<double> sample(const cv::Mat1f& image, double x, double y) {
    const int left = static_cast<int>(std::floor(x)), top = static_cast<int>(std::floor(y));
    if (left < 1 || top < 1 || left + 2 >= image.cols || top + 2 >= image.rows) return std::nullopt;
    const auto across = cubic_weights(x - left), down = cubic_weights(y - top);
    double sum = 0;
    for (int j = 0; j < 4; ++j) {
        const float* row = image.ptr<float>(top - 1 + j) + left - 1;
        double line = 0;
        for (int i = 0; i < 4; ++i) line += across[static_cast<std::size_t>(i)] * row[i];
        sum += down[static_cast<std::size_t>(j)] * line;
    }
    return sum;
}

/// Brightness along a radius, `half` steps to both sides of the circle; empty where it leaves the picture.
Eigen::VectorXd profile(const cv::Mat1f& image, const Circle& circle, cv::Point2d out, int half, double step) {
    Eigen::VectorXd values(2 * half + 1);
    for (int i = -half; i <= half; ++i) {
        const double radius = circle.radius + i * step;
        const auto value = sample(image, circle.x + radius * out.x, circle.y + radius * out.y);
        if (!value) return {};
        values[i + half] = *value;
    }
    return values;
}

std::size_t directions(const Circle& circle) {
    return static_cast<std::size_t>(std::clamp(2 * std::numbers::pi * circle.radius, 48.0, 1440.0));
}

double median(std::vector<double> values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

/// `shape`: none where it is to be learnt from the profiles.
std::vector<Reading> read_edges(const cv::Mat1f& image, const Circle& circle, double reach,
                                const std::optional<EdgeShape>& shape) {
    Profiles profiles{static_cast<int>(std::ceil((reach + margin_px) / step_px)), step_px, {}};
    std::vector<cv::Point2d> outwards;
    const std::size_t n = directions(circle);
    for (std::size_t i = 0; i < n; ++i) {
        const double angle = 2 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(n);
        const cv::Point2d out(std::cos(angle), std::sin(angle));
        Eigen::VectorXd values = profile(image, circle, out, profiles.half, step_px);
        if (values.size() == 0) continue;
        profiles.values.push_back(std::move(values));
        outwards.push_back(out);
    }
    std::vector<Reading> readings;
    if (profiles.values.empty()) return readings;
    const ProfileModel model(profiles.half, step_px, shape ? *shape : shape_of_edge(profiles, reach), reach);
    for (std::size_t i = 0; i < profiles.values.size(); ++i) {
        const Eigen::VectorXd& p = profiles.values[i];
        const auto edge = model.fit(p);
        if (!edge) continue;
        const double level = std::max(0.0, p[profiles.half]) + floor_radiance;
        const cv::Point2d at = cv::Point2d(circle.x, circle.y) + (circle.radius + edge->offset) * outwards[i];
        readings.push_back({at, edge->height / level, edge->height,
                            std::sqrt(std::max(0.0, edge->residual) / static_cast<double>(p.size()))});
    }
    return readings;
}

/// Readings all around, without those that noise explains and those far weaker than the strong ones: dark on dark has
/// no outline to read.
std::vector<cv::Point2d> read_outline(const cv::Mat1f& image, const Circle& circle, double reach,
                                      const std::optional<EdgeShape>& shape) {
    const std::vector<Reading> readings = read_edges(image, circle, reach, shape);
    if (readings.empty()) return {};
    std::vector<double> strengths, noises;
    for (const Reading& r : readings) {
        strengths.push_back(r.strength);
        noises.push_back(r.noise);
    }
    const double noise = median(noises);
    const auto strong = strengths.begin() + static_cast<std::ptrdiff_t>(strengths.size() * 8 / 10);
    std::nth_element(strengths.begin(), strong, strengths.end());
    std::vector<cv::Point2d> points;
    for (const Reading& r : readings)
        if (r.height > least_significance * noise && r.strength >= 0.2 * *strong) points.push_back(r.at);
    return points;
}

BallContour settled(const cv::Mat1f& image, const Circle& start, double first_reach) {
    BallContour contour;
    contour.circle = start;
    std::vector<cv::Point2d> points;
    for (const double reach : {first_reach, first_reach / 2, 3.0, 2.0, 2.0, 2.0}) {
        const std::optional<EdgeShape> shape =
            reach > 2 ? std::optional(EdgeShape{read_blur_px, std::nullopt}) : std::nullopt;
        points = read_outline(image, contour.circle, std::max(2.0, reach), shape);
        contour.circle = fit_circle_robust(points, contour.circle, std::max(0.3, reach / 8));
    }
    const double limit = 3 * std::max(0.1, robust_spread(points, contour.circle));
    double squares = 0;
    for (const auto& p : points) {
        const double distance = contour.circle.distance(p);
        if (std::abs(distance) > limit) continue;
        contour.points.push_back(p);
        squares += distance * distance;
    }
    contour.rejected = points.size() - contour.points.size();
    if (!contour.points.empty()) contour.spread_px = std::sqrt(squares / static_cast<double>(contour.points.size()));
    contour.support = static_cast<double>(contour.points.size()) / static_cast<double>(directions(contour.circle));
    return contour;
}

/// Fits all radii of a settled outline together, where that settles.
void fit_together(const cv::Mat1f& image, BallContour& contour) {
    const Circle from = contour.circle;
    std::vector<double> angles;
    for (const cv::Point2d& p : contour.points) angles.push_back(std::atan2(p.y - from.y, p.x - from.x));
    const ReadProfile read = [&](const Circle& circle, double angle, int half, double step) {
        return profile(image, circle, {std::cos(angle), std::sin(angle)}, half, step);
    };
    const auto fit = fit_outline(read, angles, from, EdgeShape{read_blur_px, std::nullopt});
    if (!fit) return;
    contour.circle = fit->circle;
    double squares = 0;
    for (std::size_t i = 0; i < angles.size(); ++i) {
        const double radius = fit->circle.radius + fit->offset_px[i];
        contour.points[i] = {fit->circle.x + radius * std::cos(angles[i]),
                             fit->circle.y + radius * std::sin(angles[i])};
        squares += fit->offset_px[i] * fit->offset_px[i];
    }
    contour.spread_px = std::sqrt(squares / static_cast<double>(angles.size()));
    contour.sigma_px = fit->sigma_px;
    contour.shift_covariance = fit->covariance;
}

}  // namespace

BallContour measure_contour(const cv::Mat1f& radiance, const Circle& start) {
    cv::Mat1f smooth;
    cv::GaussianBlur(radiance, smooth, {}, blur_px);
    BallContour contour = settled(smooth, start, std::clamp(0.04 * start.radius, 2.0, 8.0));
    fit_together(smooth, contour);
    return contour;
}

BallContour measure_mask(const cv::Mat1b& mask) {
    std::vector<std::vector<cv::Point>> outlines;
    cv::findContours(mask > 127, outlines, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
    std::vector<cv::Point2d> inner;
    for (const auto& outline : outlines)
        for (const cv::Point& p : outline)
            if (p.x > 0 && p.y > 0 && p.x + 1 < mask.cols && p.y + 1 < mask.rows) inner.emplace_back(p);
    const auto rough = fit_circle_algebraic(inner);
    if (!rough)
        throw InputError("the ball's mask shows no round region",
                         "paint the ball white on black, or give --ball X,Y,R");
    cv::Mat1f image;
    mask.convertTo(image, CV_32F, 1.0 / 255);
    cv::GaussianBlur(image, image, {}, blur_px);
    const Circle start = fit_circle_robust(inner, *rough, 1.0);
    return settled(image, start, 4.0);
}

}  // namespace darkbox
