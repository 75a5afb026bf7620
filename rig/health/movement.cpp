#include "rig/health/movement.h"

#include <fmt/format.h>

#include <opencv2/imgproc.hpp>

namespace darkbox {
namespace {

constexpr double around_ball = 1.2;     ///< of its radius: what is not the object
constexpr double within_ball = 1.4;     ///< its outline is what tells that it moved; fits look less far than this
constexpr double sure_of_movement = 3;  ///< standard deviations

cv::Mat1b disc(cv::Size size, const Ball& ball, double share) {
    cv::Mat1b mask(size, uchar{0});
    cv::circle(mask, cv::Point(cv::Point2d(ball.x, ball.y)), static_cast<int>(share * ball.radius), cv::Scalar(255),
               cv::FILLED);
    return mask;
}

bool moved_alike(const Shift& a, const Shift& b) {
    return cv::norm(a.px - b.px) < most_movement_px + sure_of_movement * std::hypot(a.sigma_px, b.sigma_px);
}

}  // namespace

std::string Movement::words() const {
    const char* who = !ball ? "the object, or the camera," : moved_alike(object, *ball) ? "the camera" : "the object";
    return fmt::format("{} moved by {:.2f} px (noise {:.2f})", who, object.length(), object.sigma_px);
}

bool Movement::moved(double limit_px) const { return object.length() > limit_px + sure_of_movement * object.sigma_px; }

std::optional<Movement> measure_movement(const cv::Mat1f& before, const cv::Mat1f& after, const cv::Mat1b& usable,
                                         const std::vector<Ball>& balls) {
    cv::Mat1b object = usable.clone();
    for (const Ball& ball : balls) object.setTo(0, disc(object.size(), ball, around_ball));
    const auto shift = measure_shift(before, after, object);
    if (!shift) return std::nullopt;
    Movement movement{*shift, {}};
    if (!balls.empty())
        movement.ball =
            measure_shift(before, after, cv::Mat1b(usable & disc(usable.size(), balls.front(), within_ball)));
    return movement;
}

}  // namespace darkbox
