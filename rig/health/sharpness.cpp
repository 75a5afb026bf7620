#include "rig/health/sharpness.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace darkbox {
namespace {

constexpr double strong_share = 0.3;      ///< of the strongest slope: edges from here on are looked at
constexpr double sharpest_share = 0.15;   ///< of the steps
constexpr double slopes_of_noise = 8.0;   ///< an edge is this much steeper than noise
constexpr std::size_t fewest_edges = 20;  ///< pixels that are looked at
constexpr std::size_t fewest_steps = 5;
constexpr double farthest_px = 12;  ///< that a step is followed to either side
constexpr double stride_px = 0.5;
constexpr double patience_px = 1;           ///< beyond the last rise: noise may dip
constexpr double most_return = 0.2;         ///< of a step's height, past its end
constexpr double followed = 2.1;            ///< of its standard deviation, past its end
constexpr double slope_variance = 1.0 / 3;  ///< px^2, of the two pixels that a slope is read over

struct Slopes {
    cv::Mat1f dx, dy, size;
};

Slopes slopes(const cv::Mat1f& picture) {
    Slopes result;
    const cv::Mat1f kernel = (cv::Mat1f(1, 3) << -0.5F, 0, 0.5F);
    cv::filter2D(picture, result.dx, CV_32F, kernel);
    cv::filter2D(picture, result.dy, CV_32F, kernel.t());
    cv::magnitude(result.dx, result.dy, result.size);
    return result;
}

template <typename Number>
Number quantile(std::vector<Number>& values, double share) {
    const auto place = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), place, values.end());
    return *place;
}

bool is_crest(const cv::Mat1f& slope, int v, int u) {
    const float here = slope(v, u);
    return (here >= slope(v, u - 1) && here >= slope(v, u + 1)) || (here >= slope(v - 1, u) && here >= slope(v + 1, u));
}

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
    const Slopes slope = slopes(picture);
    cv::Mat1b inside;  // not the mask's own border
    cv::erode(mask, inside, cv::Mat(), {-1, -1}, 5, cv::BORDER_CONSTANT, cv::Scalar(0));
    std::vector<float> all;
    for (int v = 1; v + 1 < picture.rows; ++v)
        for (int u = 1; u + 1 < picture.cols; ++u)
            if (inside(v, u)) all.push_back(slope.size(v, u));
    if (all.size() < fewest_edges) return std::nullopt;
    const float strongest = quantile(all, 0.999), usual = quantile(all, 0.5);
    const double least = std::max(strong_share * strongest, std::min(slopes_of_noise * usual, 0.8 * strongest));
    std::size_t edges = 0;
    std::vector<double> blurs;
    for (int v = 1; v + 1 < picture.rows; ++v)
        for (int u = 1; u + 1 < picture.cols; ++u) {
            const float here = slope.size(v, u);
            if (!inside(v, u) || here < least || here == 0 || !is_crest(slope.size, v, u)) continue;
            ++edges;
            const Profile profile(picture, cv::Point2d(u, v), {slope.dx(v, u) / here, slope.dy(v, u) / here});
            if (const auto blur = blur_of_step(profile, here)) blurs.push_back(*blur);
        }
    if (edges < fewest_edges || blurs.size() < fewest_steps) return std::nullopt;
    return quantile(blurs, sharpest_share);
}

}  // namespace darkbox
