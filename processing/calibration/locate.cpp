#include "processing/calibration/locate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "acquisition/frame/error.h"
#include "processing/calibration/ball_contour.h"
#include "processing/calibration/ball_search.h"

namespace darkbox {
namespace {

constexpr double given_ball_sigma_px = 0.5;   ///< a circle drawn by hand
constexpr double least_support = 0.15;        ///< share of the outline below which contour points say nothing
constexpr double most_contour_shift = 6;      ///< of given_ball_sigma_px: beyond this the edge is another's
constexpr double most_shift_of_found = 0.05;  ///< of the radius: beyond it the contour has slid onto something mirrored
constexpr double found_ball_sigma_px = 1;     ///< a circle from the search alone
constexpr double least_part_of_mask = 0.1;    ///< of its largest region: a smaller one is a slip of the brush

Circle circle_of(const Ball& ball) { return {ball.x, ball.y, ball.radius}; }

void require_inside(const Ball& ball, cv::Size size) {
    if (ball.x < 0 || ball.y < 0 || ball.x > size.width - 1 || ball.y > size.height - 1)
        throw InputError(fmt::format("the ball's centre ({:.1f}, {:.1f}) lies outside the picture of {}x{} pixels",
                                     ball.x, ball.y, size.width, size.height),
                         "give --ball X,Y,R in pixels from the top left corner");
    if (ball.radius > std::max(size.width, size.height))
        throw InputError(fmt::format("the ball's radius of {:.1f} pixels is larger than the picture of {}x{}",
                                     ball.radius, size.width, size.height),
                         "give --ball X,Y,R with the radius, in pixels");
}

void require_apart(const std::vector<Ball>& balls) {
    for (std::size_t i = 0; i < balls.size(); ++i)
        for (std::size_t j = 0; j < i; ++j)
            if (std::hypot(balls[i].x - balls[j].x, balls[i].y - balls[j].y) <
                std::max(balls[i].radius, balls[j].radius))
                throw InputError(fmt::format("the balls at ({:.1f}, {:.1f}) and ({:.1f}, {:.1f}) overlap", balls[j].x,
                                             balls[j].y, balls[i].x, balls[i].y),
                                 "give each ball once");
}

LocatedBall located_by(const BallContour& contour) {
    LocatedBall located;
    located.ball = {contour.circle.x, contour.circle.y, contour.circle.radius, std::min(1.0, contour.support)};
    located.contour = contour.points;
    located.contour_spread_px = contour.spread_px;
    located.contour_sigma_px = contour.sigma_px;
    located.shift_covariance = contour.shift_covariance;
    located.rejected = contour.rejected;
    return located;
}

std::vector<LocatedBall> locate_in_mask(const cv::Mat1b& mask, cv::Size size) {
    if (mask.size() != size)
        throw InputError(fmt::format("the ball's mask is {}x{} pixels but the frames are {}x{}", mask.cols, mask.rows,
                                     size.width, size.height),
                         "give a mask of the frames' size");
    cv::Mat1i labels, statistics;
    cv::Mat1d centroids;
    const int parts = cv::connectedComponentsWithStats(mask > 0, labels, statistics, centroids);
    std::vector<std::pair<int, int>> by_area;
    for (int part = 1; part < parts; ++part) by_area.emplace_back(-statistics(part, cv::CC_STAT_AREA), part);
    std::sort(by_area.begin(), by_area.end());
    if (by_area.size() <= 1) return {located_by(measure_mask(mask))};
    std::vector<LocatedBall> located;
    for (const auto& [area, part] : by_area) {
        if (area > least_part_of_mask * by_area.front().first) break;  // areas are negated
        cv::Mat1b alone = mask.clone();
        alone.setTo(0, labels != part);
        located.push_back(located_by(measure_mask(alone)));
    }
    return located;
}

/// A circle given by hand stands; the method `refined` may move it within its uncertainty onto the outline it sees.
LocatedBall locate_near(const Ball& given, const cv::Mat1f& mean, CalibrationMethod method) {
    require_inside(given, mean.size());
    LocatedBall located;
    if (method == CalibrationMethod::refined) {
        const BallContour contour = measure_contour(mean, circle_of(given));
        const double moved = std::hypot(contour.circle.x - given.x, contour.circle.y - given.y) +
                             std::abs(contour.circle.radius - given.radius);
        if (contour.support >= least_support && moved < most_contour_shift * given_ball_sigma_px)
            located = located_by(contour);
    }
    located.ball = {given.x, given.y, given.radius, 1.0};
    located.sigma_px = given_ball_sigma_px;
    return located;
}

LocatedBall locate_found(const Ball& found, const cv::Mat1f& mean) {
    const BallContour contour = measure_contour(mean, circle_of(found));
    LocatedBall located = located_by(contour);
    const double shift = std::hypot(contour.circle.x - found.x, contour.circle.y - found.y) +
                         std::abs(contour.circle.radius - found.radius);
    if (contour.support < least_support || shift > std::max(2.0, most_shift_of_found * found.radius)) {
        located.ball = found;
        located.contour.clear();
        located.sigma_px = found_ball_sigma_px;
    }
    located.ball.confidence = found.confidence;
    return located;
}

}  // namespace

std::vector<LocatedBall> locate_balls(BallPhotographs& photographs, const CalibrationOptions& options) {
    if (options.ball_mask) return locate_in_mask(*options.ball_mask, photographs.size());
    const BallOverview overview = photographs.overview(options.balls.empty() ? ball_search_side : 0);
    std::vector<LocatedBall> located;
    for (const Ball& given : options.balls) located.push_back(locate_near(given, overview.mean, options.method));
    require_apart(options.balls);
    if (!located.empty()) return located;
    for (const Ball& found : find_balls(overview.reduced)) located.push_back(locate_found(found, overview.mean));
    if (located.empty())
        throw InputError("no mirror ball was found in the frames",
                         "say where it is with --ball X,Y,R (pixels), or give --ball-mask");
    return located;
}

}  // namespace darkbox
