#include "processing/calibration/ball_search.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

#include "processing/calibration/circle_fit.h"
#include "processing/calibration/edges.h"
#include "processing/calibration/glint.h"
#include "processing/calibration/outline.h"

namespace darkbox {
namespace {

constexpr int working_side = 1024;  ///< px; the search runs on pictures no longer than this
constexpr double least_radius = 7;  ///< px
constexpr double radius_step = 1.04;
constexpr double cell_share = 0.03;  ///< a cell of the vote is this share of the radius wide
constexpr int peaks_per_radius = 4;
constexpr std::size_t circles_examined = 60;
constexpr double aligned_cosine = 0.95;
constexpr double least_score = 0.25;

struct Candidate {
    Circle circle;
    double score = 0;
};

/// The cells with most votes for one radius; their score is votes per pixel of outline.
std::vector<Candidate> vote(const std::vector<Edge>& edges, cv::Size size, double radius) {
    const double cell = std::max(1.0, cell_share * radius);
    cv::Mat1f votes(static_cast<int>(size.height / cell) + 1, static_cast<int>(size.width / cell) + 1, 0.0F);
    for (const Edge& edge : edges)
        for (const double side : {-radius, radius}) {
            const cv::Point2d centre = edge.at + side * edge.across;
            const int column = static_cast<int>(std::floor(centre.x / cell));
            const int row = static_cast<int>(std::floor(centre.y / cell));
            if (row >= 0 && row < votes.rows && column >= 0 && column < votes.cols) votes(row, column) += 1;
        }
    cv::boxFilter(votes, votes, -1, {3, 3}, {-1, -1}, false, cv::BORDER_CONSTANT);

    std::vector<Candidate> peaks;
    for (int i = 0; i < peaks_per_radius; ++i) {
        double most = 0;
        cv::Point at;
        cv::minMaxLoc(votes, nullptr, &most, nullptr, &at);
        if (!(most > 0)) break;
        peaks.push_back({{(at.x + 0.5) * cell, (at.y + 0.5) * cell, radius}, most / (2 * std::numbers::pi * radius)});
        cv::circle(votes, at, 3, 0, cv::FILLED);
    }
    return peaks;
}

bool supports(const Edge& edge, const Circle& circle, double tolerance) {
    if (std::abs(circle.distance(edge.at)) > tolerance) return false;
    const cv::Point2d out = edge.at - cv::Point2d(circle.x, circle.y);
    return std::abs(out.dot(edge.across)) > aligned_cosine * cv::norm(out);
}

/// The circle pulled onto the edges around it, from a wide band to a narrow one.
Circle settle(const std::vector<Edge>& edges, Circle circle) {
    for (const double band : {0.08, 0.04, 0.02, 0.02}) {
        const double tolerance = std::max(1.5, band * circle.radius);
        std::vector<cv::Point2d> near;
        for (const Edge& edge : edges)
            if (supports(edge, circle, tolerance)) near.push_back(edge.at);
        circle = fit_circle_robust(near, circle, tolerance / 2);
    }
    return circle;
}

/// Share of the outline that has an edge along it.
double outline_support(const std::vector<Edge>& edges, const Circle& circle) {
    const int bins = std::clamp(static_cast<int>(2 * std::numbers::pi * circle.radius / 3), 24, 180);
    std::vector<char> hit(static_cast<std::size_t>(bins));
    for (const Edge& edge : edges) {
        if (!supports(edge, circle, 1.2)) continue;
        const double turn = std::atan2(edge.at.y - circle.y, edge.at.x - circle.x) / (2 * std::numbers::pi) + 0.5;
        hit[static_cast<std::size_t>(std::min(bins - 1, static_cast<int>(turn * bins)))] = 1;
    }
    return static_cast<double>(std::count(hit.begin(), hit.end(), 1)) / bins;
}

std::vector<Candidate> most_voted(const std::vector<Edge>& edges, cv::Size size) {
    std::vector<Candidate> candidates;
    for (double radius = least_radius; radius < 0.6 * std::min(size.width, size.height); radius *= radius_step)
        for (const Candidate& peak : vote(edges, size, radius)) candidates.push_back(peak);
    std::stable_sort(candidates.begin(), candidates.end(),
                     [](const Candidate& a, const Candidate& b) { return a.score > b.score; });
    candidates.resize(std::min(candidates.size(), circles_examined));
    return candidates;
}

bool centre_inside(const Circle& circle, cv::Size size) {
    return circle.x >= 0 && circle.y >= 0 && circle.x <= size.width - 1 && circle.y <= size.height - 1;
}

}  // namespace

std::optional<Ball> find_ball(const std::vector<cv::Mat3f>& frames) {
    const ReducedFrames reduced = reduce(frames, working_side);
    cv::Mat1f mean(reduced.images.front().size(), 0.0F);
    for (const cv::Mat1f& image : reduced.images) mean += image / static_cast<double>(reduced.images.size());
    const std::vector<Edge> edges = find_edges(compress(mean));

    std::optional<Ball> best;
    double best_score = least_score;
    for (const Candidate& candidate : most_voted(edges, mean.size())) {
        const Circle circle = settle(edges, candidate.circle);
        if (!centre_inside(circle, mean.size()) || circle.radius < least_radius) continue;
        const double support = outline_support(edges, circle);
        if (support <= best_score) continue;
        const double score = support * glint_share(reduced.images, circle);
        if (score <= best_score) continue;
        best_score = score;
        best = Ball{reduced.to_frame(circle.x), reduced.to_frame(circle.y), circle.radius * reduced.scale, support};
    }
    return best;
}

}  // namespace darkbox
