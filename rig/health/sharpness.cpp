#include "rig/health/sharpness.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "processing/calibration/strong_edges.h"

namespace darkbox {
namespace {

constexpr std::size_t fewest_edges = 20;  ///< pixels that are looked at
constexpr std::size_t fewest_steps = 5;
constexpr double farthest_px = 12;  ///< that a step is followed to either side
constexpr double stride_px = 0.5;
constexpr double patience_px = 1;           ///< beyond the last rise: noise may dip
constexpr double most_return = 0.2;         ///< of a step's height, past its end
constexpr double followed = 2.1;            ///< of its standard deviation, past its end
constexpr double slope_variance = 1.0 / 3;  ///< px^2, of the two pixels that a slope is read over

/// The picture along a line through a pixel.
class Profile {
public:
    Profile(const cv::Mat1f& picture, cv::Point2d through, cv::Point2d along)
        : picture_(picture), through_(through), along_(along) {}

    /// No value outside the picture.
    std::optional<double> at(double distance) const {
        const cv::Point2d place = through_ + distance * along_;
        const int u = static_cast<int>(std::floor(place.x)), v = static_cast<int>(std::floor(place.y));
        if (u < 0 || v < 0 || u + 1 >= picture_.cols || v + 1 >= picture_.rows) return std::nullopt;
        const double a = place.x - u, b = place.y - v;
        return (1 - b) * ((1 - a) * picture_(v, u) + a * picture_(v, u + 1)) +
               b * ((1 - a) * picture_(v + 1, u) + a * picture_(v + 1, u + 1));
    }

private:
    const cv::Mat1f& picture_;
    cv::Point2d through_, along_;
};

/// Where a step ends to one side (direction 1: it rises, -1: it falls).
struct End {
    double distance = 0;
    double level = 0;
};

End end_of(const Profile& profile, int direction) {
    End end{0, profile.at(0).value_or(0)};
    for (double t = stride_px; t <= farthest_px && t <= end.distance + patience_px; t += stride_px) {
        const auto level = profile.at(direction * t);
        if (!level) break;
        if (direction * (*level - end.level) > 0) end = {t, *level};
    }
    return end;
}

/// Whether the picture stays where the step led: a line's other flank returns.
bool stays(const Profile& profile, int direction, const End& end, double reach, double most) {
    for (double t = end.distance; t <= end.distance + reach; t += stride_px) {
        const auto level = profile.at(direction * t);
        if (!level || direction * (end.level - *level) > most) return false;
    }
    return true;
}

/// The standard deviation of the Gaussian that a step was blurred with: its height over its steepest slope tells. No
/// value for what is no step.
std::optional<double> blur_of_step(const Profile& profile, double slope) {
    const End top = end_of(profile, 1), bottom = end_of(profile, -1);
    const double height = top.level - bottom.level;
    const double apparent = height / (slope * std::sqrt(2 * std::numbers::pi));
    const double reach = followed * apparent;
    if (!stays(profile, 1, top, reach, most_return * height) ||
        !stays(profile, -1, bottom, reach, most_return * height))
        return std::nullopt;
    return std::sqrt(std::max(0.0, apparent * apparent - slope_variance));
}

}  // namespace

std::optional<double> measure_blur(const cv::Mat1f& picture, const cv::Mat1b& mask) {
    const Slopes slopes = slopes_of(picture);
    const std::vector<cv::Point> edges = strong_edges(slopes, mask, fewest_edges);
    std::vector<double> blurs;
    for (const cv::Point& at : edges) {
        const float here = slopes.size(at);
        const Profile profile(picture, at, {slopes.dx(at) / here, slopes.dy(at) / here});
        if (const auto blur = blur_of_step(profile, here)) blurs.push_back(*blur);
    }
    if (edges.size() < fewest_edges || blurs.size() < fewest_steps) return std::nullopt;
    return sharpest_of(blurs);
}

}  // namespace darkbox
