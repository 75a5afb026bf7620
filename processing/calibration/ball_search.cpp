#include "processing/calibration/ball_search.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

#include "processing/calibration/circle_fit.h"
#include "processing/calibration/edges.h"
#include "processing/calibration/glint.h"

namespace darkbox {
namespace {

constexpr double least_radius = 7;  ///< px
constexpr double radius_step = 1.04;
constexpr double cell_share = 0.03;  ///< a cell of the vote is this share of the radius wide
constexpr std::size_t peaks_per_radius = 6;
constexpr int cells_per_radius = 60;
constexpr std::size_t circles_examined = 150;
constexpr std::size_t flash_images = 16;  ///< images that the first sifting looks at
constexpr double least_flashing = 0.5;    ///< share of them that must flash
constexpr double outer_share = 0.8;       ///< of a circle's score: a circle around it that has as much is the outline
constexpr double same_glint = 0.25;       ///< radii between two balls' glints of one lamp
constexpr double aligned_cosine = 0.95;
constexpr double least_score = 0.25;
constexpr double least_in_view = 0.4;  ///< of the outline: less does not tell a circle

struct Candidate {
    Circle circle;
    double score = 0;
    std::vector<std::optional<cv::Point2d>> glints;
};

/// Where glints may be: for some of the images, each pixel's distance to the nearest flash.
class FlashMap {
public:
    explicit FlashMap(const std::vector<cv::Mat1f>& images) {
        const std::vector<cv::Mat1b> masks = flashes(images);
        const std::size_t step = (masks.size() + flash_images - 1) / flash_images;
        for (std::size_t i = 0; i < masks.size(); i += step) {
            distances_.emplace_back();
            cv::distanceTransform(masks[i] == 0, distances_.back(), cv::DIST_L2, 3);
        }
    }

    /// Whether most images flash within the circle.
    bool allows(const Circle& circle) const {
        const cv::Point at(cvRound(circle.x), cvRound(circle.y));
        const auto count = std::count_if(distances_.begin(), distances_.end(), [&](const cv::Mat1f& distance) {
            return cv::Rect({}, distance.size()).contains(at) && distance(at) < mirror_zone * circle.radius;
        });
        return static_cast<double>(count) >= least_flashing * static_cast<double>(distances_.size());
    }

private:
    std::vector<cv::Mat1f> distances_;
};

/// The cells with most votes for one radius; their score is votes per pixel of outline.
std::vector<Candidate> vote(const std::vector<Edge>& edges, const FlashMap& flashing, cv::Size size, double radius) {
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
    for (int i = 0; i < cells_per_radius && peaks.size() < peaks_per_radius; ++i) {
        double most = 0;
        cv::Point at;
        cv::minMaxLoc(votes, nullptr, &most, nullptr, &at);
        if (!(most > 0)) break;
        const Circle circle{(at.x + 0.5) * cell, (at.y + 0.5) * cell, radius};
        if (flashing.allows(circle)) peaks.push_back({circle, most / (2 * std::numbers::pi * radius), {}});
        cv::circle(votes, at, 2, 0, cv::FILLED);
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

/// Share of the outline in view that has an edge along it.
double outline_support(const std::vector<Edge>& edges, const Circle& circle, cv::Size size) {
    const int bins = std::clamp(static_cast<int>(2 * std::numbers::pi * circle.radius / 3), 24, 180);
    std::vector<char> hit(static_cast<std::size_t>(bins));
    for (const Edge& edge : edges) {
        if (!supports(edge, circle, 1.2)) continue;
        const double turn = std::atan2(edge.at.y - circle.y, edge.at.x - circle.x) / (2 * std::numbers::pi) + 0.5;
        hit[static_cast<std::size_t>(std::min(bins - 1, static_cast<int>(turn * bins)))] = 1;
    }
    int in_view = 0;
    for (int i = 0; i < bins; ++i) {
        const double angle = 2 * std::numbers::pi * ((i + 0.5) / bins - 0.5);
        const double x = circle.x + circle.radius * std::cos(angle), y = circle.y + circle.radius * std::sin(angle);
        in_view += x >= 1 && y >= 1 && x <= size.width - 2 && y <= size.height - 2;
    }
    if (in_view < least_in_view * bins) return 0;
    return std::min(1.0, static_cast<double>(std::count(hit.begin(), hit.end(), 1)) / in_view);
}

std::vector<Candidate> most_voted(const std::vector<Edge>& edges, const FlashMap& flashing, cv::Size size) {
    std::vector<Candidate> candidates;
    for (double radius = least_radius; radius < 0.6 * std::min(size.width, size.height); radius *= radius_step)
        for (const Candidate& peak : vote(edges, flashing, size, radius)) candidates.push_back(peak);
    std::stable_sort(candidates.begin(), candidates.end(),
                     [](const Candidate& a, const Candidate& b) { return a.score > b.score; });
    candidates.resize(std::min(candidates.size(), circles_examined));
    return candidates;
}

bool centre_inside(const Circle& circle, cv::Size size) {
    return circle.x >= 0 && circle.y >= 0 && circle.x <= size.width - 1 && circle.y <= size.height - 1;
}

/// The voted circles pulled onto their edges and judged, the surest first.
std::vector<Candidate> judged(const std::vector<cv::Mat1f>& images, const std::vector<Edge>& edges) {
    const cv::Size size = images.front().size();
    std::vector<Candidate> balls;
    for (const Candidate& candidate : most_voted(edges, FlashMap(images), size)) {
        const Circle circle = settle(edges, candidate.circle);
        if (!centre_inside(circle, size) || circle.radius < least_radius) continue;
        const double support = outline_support(edges, circle, size);
        if (support < least_score) continue;
        auto glints = find_glints(images, circle);
        const double score = support * glint_share(glints);
        if (score >= least_score) balls.push_back({circle, score, std::move(glints)});
    }
    std::stable_sort(balls.begin(), balls.end(),
                     [](const Candidate& a, const Candidate& b) { return a.score > b.score; });
    return balls;
}

double distance(const Circle& a, const Circle& b) { return std::hypot(a.x - b.x, a.y - b.y); }

bool overlap(const Circle& a, const Circle& b) {
    return distance(a, b) < a.radius + b.radius - 0.1 * std::min(a.radius, b.radius);
}

/// What a ball mirrors can draw a circle inside its outline, never outside: of circles as good, the outermost.
Candidate outermost(const Candidate& best, const std::vector<Candidate>& candidates) {
    Candidate outer = best;
    for (const Candidate& c : candidates) {
        const double room = c.circle.radius - outer.circle.radius;
        if (room > 0 && room < 0.5 * best.circle.radius && c.score >= outer_share * best.score &&
            distance(c.circle, outer.circle) < room + 1)
            outer = c;
    }
    return outer;
}

/// Whether both show their lamps in the same places: the median distance tells.
bool lit_alike(const Candidate& a, const Candidate& b) {
    std::vector<double> distances;
    for (std::size_t i = 0; i < a.glints.size(); ++i)
        if (a.glints[i] && b.glints[i]) distances.push_back(cv::norm(*a.glints[i] - *b.glints[i]));
    if (distances.empty()) return false;
    const auto middle = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2);
    std::nth_element(distances.begin(), middle, distances.end());
    return *middle < same_glint;
}

}  // namespace

std::vector<Ball> find_balls(const std::vector<cv::Mat3f>& frames) {
    return find_balls(reduce(frames, ball_search_side));
}

std::vector<Ball> find_balls(const ReducedFrames& reduced) {
    cv::Mat1f mean(reduced.images.front().size(), 0.0F);
    for (const cv::Mat1f& image : reduced.images) mean += image / static_cast<double>(reduced.images.size());
    const std::vector<Candidate> candidates = judged(reduced.images, find_edges(compress(mean)));

    std::vector<Candidate> chosen;
    for (const Candidate& candidate : candidates) {
        const auto taken = [&](const Candidate& c) { return overlap(c.circle, candidate.circle); };
        if (std::any_of(chosen.begin(), chosen.end(), taken)) continue;
        if (!chosen.empty() && !lit_alike(chosen.front(), candidate)) continue;
        chosen.push_back(outermost(candidate, candidates));
    }
    std::vector<Ball> balls;
    for (const Candidate& c : chosen)
        balls.push_back(
            {reduced.to_frame(c.circle.x), reduced.to_frame(c.circle.y), c.circle.radius * reduced.scale, c.score});
    std::stable_sort(balls.begin(), balls.end(),
                     [](const Ball& a, const Ball& b) { return a.confidence > b.confidence; });
    return balls;
}

}  // namespace darkbox
