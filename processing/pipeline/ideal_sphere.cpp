#include "processing/pipeline/ideal_sphere.h"

#include <fmt/format.h>

#include <cmath>
#include <vector>

#include "acquisition/frame/error.h"

namespace darkbox {
namespace {

constexpr double fit_scale_px = 1.0;          // a mask's outline is a staircase of about this height
constexpr double max_relative_spread = 0.02;  // of the radius; beyond it the object is no ball
constexpr double min_spread_px = 0.5;         // what the staircase alone gives, however small the ball

std::vector<cv::Point2d> border_of(const cv::Mat1b& mask) {
    std::vector<cv::Point2d> border;
    for (int y = 0; y < mask.rows; ++y)
        for (int x = 0; x < mask.cols; ++x) {
            const bool inside = mask(y, x) != 0;
            if (x + 1 < mask.cols && inside != (mask(y, x + 1) != 0)) border.emplace_back(x + 0.5, y);
            if (y + 1 < mask.rows && inside != (mask(y + 1, x) != 0)) border.emplace_back(x, y + 0.5);
        }
    return border;
}

NormalMap sphere_normals(const Circle& outline, const cv::Mat1b& mask) {
    NormalMap sphere{cv::Mat3f(mask.size(), cv::Vec3f::all(0)), cv::Mat1b(mask.size(), uchar{0})};
    for (int y = 0; y < mask.rows; ++y)
        for (int x = 0; x < mask.cols; ++x) {
            const double nx = (x - outline.x) / outline.radius;
            const double ny = (outline.y - y) / outline.radius;
            const double squared = nx * nx + ny * ny;
            if (mask(y, x) == 0 || squared >= 1) continue;
            sphere.normal(y, x) = cv::Vec3d(nx, ny, std::sqrt(1 - squared));
            sphere.valid(y, x) = 255;
        }
    return sphere;
}

}  // namespace

IdealSphere ideal_sphere(const cv::Mat1b& mask) {
    const std::vector<cv::Point2d> border = border_of(mask);
    const auto start = fit_circle_algebraic(border);
    if (!start)
        throw InputError("the mask has no outline that a circle could be fitted to",
                         "an ideal sphere needs a capture of a ball with a mask of it");
    IdealSphere sphere;
    sphere.outline = fit_circle_robust(border, *start, fit_scale_px);
    sphere.spread_px = robust_spread(border, sphere.outline);
    if (sphere.spread_px > std::max(min_spread_px, max_relative_spread * sphere.outline.radius))
        throw InputError(fmt::format("the mask's outline is no circle: it lies {:.1f} px about one of radius {:.1f} px",
                                     sphere.spread_px, sphere.outline.radius),
                         "an ideal sphere is the truth of a ball only; leave --ideal-sphere out for other objects");
    sphere.normals = sphere_normals(sphere.outline, mask);
    return sphere;
}

}  // namespace darkbox
