#include "processing/calibration/highlight.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "processing/calibration/glint.h"
#include "processing/maps/maps.h"

namespace darkbox {
namespace {

constexpr float full_scale = 0.98F;           ///< radiance from here on is taken as clipped
constexpr double least_peak = 0.02;           ///< radiance above what stands still
constexpr double least_peak_of_median = 0.2;  ///< of the frames' median peak: a weaker one is not the lamp
constexpr double max_share_of_zone = 0.1;     ///< a lamp's image covers less of the mirror zone than this
constexpr double max_small_area_px = 12;
constexpr double shape_error = 0.01;  ///< of a spot's diameter: lamps are not perfect discs
constexpr float fringe_share = 0.1F;  ///< of the peak: radiance that counts at a spot's fringe
constexpr double least_sigma_px = 0.02;

/// The part of the frames where lamps are mirrored: a rectangle about the zone, and which of its pixels are inside.
struct Zone {
    cv::Rect box;
    cv::Mat1b inside;
    double area = 0;
};

Zone mirror_zone_of(const Ball& ball, cv::Size size) {
    const double reach = mirror_zone * ball.radius;
    const cv::Point from(static_cast<int>(std::floor(ball.x - reach)), static_cast<int>(std::floor(ball.y - reach)));
    const cv::Point to(static_cast<int>(std::ceil(ball.x + reach)) + 1,
                       static_cast<int>(std::ceil(ball.y + reach)) + 1);
    Zone zone;
    zone.box = cv::Rect(from, to) & cv::Rect({}, size);
    zone.inside = cv::Mat1b(zone.box.size(), uchar{0});
    for (int y = 0; y < zone.box.height; ++y)
        for (int x = 0; x < zone.box.width; ++x)
            if (std::hypot(x + zone.box.x - ball.x, y + zone.box.y - ball.y) <= reach) zone.inside(y, x) = 255;
    zone.area = cv::countNonZero(zone.inside);
    return zone;
}

std::vector<cv::Mat1f> zone_images(const std::vector<cv::Mat3f>& frames, const Zone& zone) {
    std::vector<cv::Mat1f> images;
    for (const cv::Mat3f& frame : frames) {
        cv::Mat1f image = mean_channel(frame(zone.box));
        image.setTo(0, zone.inside == 0);
        images.push_back(image);
    }
    return images;
}

/// Lower quartile over the frames, pixel by pixel: what shines there whichever lamp is on.
cv::Mat1f standing_light(const std::vector<cv::Mat1f>& images) {
    cv::Mat1f standing(images.front().size(), 0.0F);
    if (images.size() < 3) return standing;
    std::vector<float> values(images.size());
    const auto quartile = values.begin() + static_cast<std::ptrdiff_t>(images.size() / 4);
    for (int y = 0; y < standing.rows; ++y)
        for (int x = 0; x < standing.cols; ++x) {
            for (std::size_t i = 0; i < images.size(); ++i) values[i] = images[i](y, x);
            std::nth_element(values.begin(), quartile, values.end());
            standing(y, x) = *quartile;
        }
    return standing;
}

struct Spot {
    double weight = 0;
    double area = 0;
    cv::Rect box;
    int label = 0;
};

struct Spots {
    cv::Mat1i labels;
    std::vector<Spot> spots;
    float threshold = 0;
};

/// Connected pixels above half the peak's height.
Spots bright_spots(const cv::Mat1f& moving, float peak) {
    Spots found;
    found.threshold = peak / 2;
    cv::Mat1i stats;
    cv::Mat1d centres;
    const int labels = cv::connectedComponentsWithStats(moving > found.threshold, found.labels, stats, centres);
    for (int label = 1; label < labels; ++label)
        found.spots.push_back({0,
                               1.0 * stats(label, cv::CC_STAT_AREA),
                               {stats(label, cv::CC_STAT_LEFT), stats(label, cv::CC_STAT_TOP),
                                stats(label, cv::CC_STAT_WIDTH), stats(label, cv::CC_STAT_HEIGHT)},
                               label});
    for (Spot& spot : found.spots)
        for (int y = spot.box.y; y < spot.box.br().y; ++y)
            for (int x = spot.box.x; x < spot.box.br().x; ++x)
                if (found.labels(y, x) == spot.label) spot.weight += moving(y, x);
    std::stable_sort(found.spots.begin(), found.spots.end(),
                     [](const Spot& a, const Spot& b) { return a.weight > b.weight; });
    return found;
}

/// Standard deviation of the pixels' noise: from the differences of neighbours, most of which see no edge.
double noise_of(const cv::Mat1f& image, const cv::Mat1b& inside) {
    std::vector<float> differences;
    for (int y = 0; y < image.rows; ++y)
        for (int x = 1; x < image.cols; ++x)
            if (inside(y, x) && inside(y, x - 1)) differences.push_back(std::abs(image(y, x) - image(y, x - 1)));
    if (differences.empty()) return 0;
    const auto middle = differences.begin() + static_cast<std::ptrdiff_t>(differences.size() / 2);
    std::nth_element(differences.begin(), middle, differences.end());
    return 1.4826 * *middle / std::sqrt(2.0);
}

/// The spot grown by a pixel, for the half-covered pixels around it, which hold much of a small spot's position.
cv::Mat1b with_fringe(const Spots& spots, const Spot& spot) {
    cv::Mat1b member;
    cv::compare(spots.labels, spot.label, member, cv::CMP_EQ);
    cv::dilate(member, member, cv::Mat1b(3, 3, uchar{1}));
    return member;
}

Highlight centroid(const cv::Mat1f& image, const Spots& spots, const Spot& spot, const Zone& zone, double noise) {
    const cv::Mat1b member = with_fringe(spots, spot);
    const float floor = fringe_share * 2 * spots.threshold;
    std::vector<cv::Point> pixels;
    cv::findNonZero(member, pixels);
    Highlight highlight;
    double sum = 0, most = 0;
    cv::Point2d moment(0, 0);
    for (const cv::Point& p : pixels) {
        const double weight = std::max(0.0F, std::min(image(p), full_scale) - floor);
        most = std::max(most, weight);
        highlight.clipped |= image(p) >= full_scale;
        sum += weight;
        moment += weight * cv::Point2d(p);
    }
    const cv::Point2d middle = moment / sum;
    double leverage = 0;  // what a unit of noise in every pixel does to the centroid, squared
    for (const cv::Point& p : pixels) leverage += (cv::Point2d(p) - middle).dot(cv::Point2d(p) - middle) / 2;
    highlight.area_px = sum / most;
    highlight.u = middle.x + zone.box.x;
    highlight.v = middle.y + zone.box.y;
    const double diameter = 2 * std::sqrt(spot.area / CV_PI);
    highlight.sigma_px = std::hypot(noise * std::sqrt(leverage) / sum, shape_error * diameter, least_sigma_px);
    return highlight;
}

std::vector<float> peaks_of(const std::vector<cv::Mat1f>& moving) {
    std::vector<float> peaks;
    for (const cv::Mat1f& image : moving) {
        cv::Mat1f smooth;  // one hot pixel is not a peak
        cv::GaussianBlur(image, smooth, {}, 0.7);
        double peak = 0;
        cv::minMaxLoc(smooth, nullptr, &peak);
        peaks.push_back(static_cast<float>(peak));
    }
    return peaks;
}

float median(std::vector<float> values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

HighlightReading read_frame(const cv::Mat1f& image, const cv::Mat1f& moving, float peak, float usual,
                            const Zone& zone) {
    if (peak < least_peak) return {std::nullopt, "the ball shows no bright spot", 0};
    if (peak < least_peak_of_median * usual)
        return {std::nullopt, "the brightest spot on the ball is far dimmer than in the other frames", 0};
    const Spots spots = bright_spots(moving, peak);
    const double limit = std::max(max_small_area_px, max_share_of_zone * zone.area);
    for (const Spot& spot : spots.spots) {
        if (spot.area > limit) continue;
        const double noise = noise_of(image, zone.inside);
        return {centroid(image, spots, spot, zone, noise), "", static_cast<int>(spots.spots.size()) - 1};
    }
    return {std::nullopt, "what shines on the ball is too large to be a lamp", static_cast<int>(spots.spots.size())};
}

}  // namespace

std::vector<HighlightReading> find_highlights(const std::vector<cv::Mat3f>& frames, const Ball& ball) {
    const Zone zone = mirror_zone_of(ball, frames.front().size());
    const std::vector<cv::Mat1f> images = zone_images(frames, zone);
    const cv::Mat1f standing = standing_light(images);
    std::vector<cv::Mat1f> moving;
    for (const cv::Mat1f& image : images) moving.emplace_back(image - standing);
    const std::vector<float> peaks = peaks_of(moving);
    const float usual = median(peaks);

    std::vector<HighlightReading> readings;
    for (std::size_t i = 0; i < frames.size(); ++i)
        readings.push_back(read_frame(images[i], moving[i], peaks[i], usual, zone));
    return readings;
}

std::vector<HighlightReading> find_brightest(const std::vector<cv::Mat3f>& frames, const Ball& ball) {
    const Zone zone = mirror_zone_of(ball, frames.front().size());
    std::vector<HighlightReading> readings;
    for (const cv::Mat1f& image : zone_images(frames, zone)) {
        double peak = 0;
        cv::minMaxLoc(image, nullptr, &peak);
        if (peak < least_peak) {
            readings.push_back({std::nullopt, "the ball shows no bright spot", 0});
            continue;
        }
        std::vector<cv::Point> plateau;
        cv::findNonZero(image >= peak, plateau);
        const cv::Scalar middle = cv::mean(plateau);
        const Highlight spot{middle[0] + zone.box.x, middle[1] + zone.box.y, 0.5, peak >= full_scale};
        readings.push_back({spot, "", 0});
    }
    return readings;
}

}  // namespace darkbox
