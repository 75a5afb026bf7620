#include "processing/pipeline/ball_picture.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

#include "processing/maps/srgb.h"

namespace darkbox {
namespace {

constexpr double margin = 1.3;         // of the radius
constexpr double wanted_side = 640.0;  // view pixels
constexpr int sub_pixel_bits = 4;      // OpenCV's fixed-point coordinates
const cv::Scalar outline_colour(64, 224, 255);
const cv::Scalar highlight_colour(255, 64, 64);

cv::Rect box_of(const std::vector<Ball>& balls, cv::Size size) {
    cv::Rect box;
    for (const Ball& ball : balls) {
        const double reach = margin * ball.radius;
        const cv::Rect own(static_cast<int>(std::floor(ball.x - reach)), static_cast<int>(std::floor(ball.y - reach)),
                           static_cast<int>(std::ceil(2 * reach)), static_cast<int>(std::ceil(2 * reach)));
        box = box.empty() ? own : box | own;
    }
    const cv::Rect whole({0, 0}, size);
    const cv::Rect inside = box & whole;
    return inside.empty() ? whole : inside;
}

cv::Point fixed_point(const cv::Point2d& p) {
    constexpr double one = 1 << sub_pixel_bits;
    return {static_cast<int>(std::lround(p.x * one)), static_cast<int>(std::lround(p.y * one))};
}

}  // namespace

BallView view_of_balls(const cv::Mat3f& brightest, const std::vector<Ball>& balls) {
    const cv::Rect box = box_of(balls, brightest.size());
    BallView view;
    view.scale = std::clamp(std::floor(wanted_side / std::max(box.width, box.height)), 1.0, 16.0);
    view.origin = {static_cast<double>(box.x), static_cast<double>(box.y)};
    cv::resize(viewable(brightest(box).clone()), view.image, {}, view.scale, view.scale, cv::INTER_NEAREST);
    return view;
}

cv::Mat3b draw_balls(const BallView& view, const Calibration& calibration) {
    cv::Mat3b drawn = view.image.clone();
    for (const Ball& ball : calibration.balls) {
        const BallEllipse axes = ball.ellipse.value_or(BallEllipse{ball.radius, ball.radius, 0});
        const cv::Point half = fixed_point({axes.along * view.scale, axes.across * view.scale});
        cv::ellipse(drawn, fixed_point(view.in_view(ball.x, ball.y)), {half.x, half.y},
                    axes.angle_rad * 180 / std::numbers::pi, 0, 360, outline_colour, 1, cv::LINE_AA, sub_pixel_bits);
    }
    for (const auto& ball : calibration.readings)
        for (const auto& highlight : ball)
            if (highlight)
                cv::drawMarker(drawn, view.in_view(highlight->u, highlight->v), highlight_colour, cv::MARKER_CROSS, 13,
                               1, cv::LINE_AA);
    return drawn;
}

}  // namespace darkbox
