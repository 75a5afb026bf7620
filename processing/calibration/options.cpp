#include <fmt/format.h>

#include <cmath>

#include "acquisition/frame/error.h"
#include "processing/calibration/calibration.h"

namespace darkbox {
namespace {

constexpr double least_radius_px = 3;

bool finite(const cv::Point2d& p) { return std::isfinite(p.x) && std::isfinite(p.y); }

void require_positive(double value, const char* field, const char* unit) {
    if (!(std::isfinite(value) && value > 0))
        throw InputError(fmt::format("{} is {}", field, value), fmt::format("allowed: more than 0 {}", unit));
}

void validate(const Ball& ball) {
    if (!finite({ball.x, ball.y}))
        throw InputError(fmt::format("ball.x, ball.y are {}, {}", ball.x, ball.y), "allowed: numbers, in pixels");
    if (!(std::isfinite(ball.radius) && ball.radius >= least_radius_px))
        throw InputError(fmt::format("ball.radius is {}", ball.radius),
                         fmt::format("allowed: {} pixels or more", least_radius_px));
}

void validate(const ViewGeometry& view) {
    require_positive(view.mm_per_pixel, "view.mm_per_pixel", "mm");
    if (!finite(view.principal))
        throw InputError(fmt::format("view.principal is ({}, {})", view.principal.x, view.principal.y),
                         "allowed: numbers, in pixels");
    if (!(view.distance_mm > 0))
        throw InputError(fmt::format("view.distance_mm is {}", view.distance_mm),
                         "allowed: more than 0 mm; infinite for an orthographic camera");
}

void validate(const NominalLamps& nominal) {
    require_positive(nominal.slack_mm, "nominal.slack_mm", "mm");
    require_positive(nominal.turn_sigma_deg, "nominal.turn_sigma_deg", "degrees");
    require_positive(nominal.shift_sigma_mm, "nominal.shift_sigma_mm", "mm");
    for (const auto& place : nominal.position_in_rig_mm)
        if (place && !(place->allFinite() && place->norm() > 0))
            throw InputError(
                fmt::format("nominal.position_in_rig_mm has ({}, {}, {})", place->x(), place->y(), place->z()),
                "allowed: numbers, in mm, away from the origin");
}

}  // namespace

void CalibrationOptions::validate() const {
    for (const Ball& ball : balls) darkbox::validate(ball);
    if (!balls.empty() && ball_mask)
        throw InputError("both balls and ball_mask are given", "give one of them: each says where the ball is");
    for (const auto& [file, at] : highlights)
        if (!finite(at))
            throw InputError(fmt::format("highlights: {} is at ({}, {})", file, at.x, at.y),
                             "allowed: numbers, in pixels");
    if (view) darkbox::validate(*view);
    if (ball_diameter_mm) require_positive(*ball_diameter_mm, "ball_diameter_mm", "mm");
    if (nominal) darkbox::validate(*nominal);
    if (object && !finite(*object))
        throw InputError(fmt::format("object is at ({}, {})", object->x, object->y), "allowed: numbers, in pixels");
}

}  // namespace darkbox
