#include "processing/calibration/highlight.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "processing/calibration/glint.h"
#include "processing/calibration/spot.h"
#include "processing/maps/maps.h"

namespace darkbox {
namespace {

constexpr float full_scale = 0.98F;            ///< radiance from here on is taken as clipped
constexpr float merged_scale = 1.05F;          ///< radiance from here on comes from merged exposures: not clipped
constexpr double least_peak = 0.02;            ///< radiance above what stands still
constexpr double least_peak_of_median = 0.2;   ///< of the frames' median peak: a weaker one is not the lamp
constexpr double least_share_of_other = 0.15;  ///< of the lamp's peak: a weaker spot is not another lamp
constexpr double max_share_of_zone = 0.1;      ///< a lamp's image covers less of the mirror zone than this
constexpr double max_small_area_px = 12;
constexpr int fringe_px = 3;             ///< around a spot: half-covered and blurred pixels hold much of its position
constexpr double windowed_share = 0.72;  ///< of a disc's lopsidedness that a centroid in a Gaussian window keeps
constexpr int margin_px = 8;  ///< around the mirror zone, for the fringe and the background of spots at its border

/// The part of the frames where lamps are mirrored: a rectangle about the zone, and which of its pixels are inside.
struct Zone {
    cv::Rect box;
    cv::Mat1b inside;
    double area = 0;
};

Zone mirror_zone_of(const Ball& ball, const cv::Rect& box) {
    const double reach = mirror_zone * ball.radius;
    Zone zone;
    zone.box = box;
    zone.inside = cv::Mat1b(zone.box.size(), uchar{0});
    for (int y = 0; y < zone.box.height; ++y)
        for (int x = 0; x < zone.box.width; ++x)
            if (std::hypot(x + zone.box.x - ball.x, y + zone.box.y - ball.y) <= reach) zone.inside(y, x) = 255;
    zone.area = cv::countNonZero(zone.inside);
    return zone;
}

/// One frame's zone: luminance, the brightest channel, and luminance above what stands still.
struct ZoneImage {
    cv::Mat3f colour;
    cv::Mat1f luminance;
    cv::Mat1f strongest;
    cv::Mat1f moving;
};

cv::Mat1f strongest_channel(const cv::Mat3f& image) {
    cv::Mat1f strongest(image.size());
    for (int y = 0; y < image.rows; ++y)
        for (int x = 0; x < image.cols; ++x) {
            const cv::Vec3f& p = image(y, x);
            strongest(y, x) = std::max({p[0], p[1], p[2]});
        }
    return strongest;
}

/// Lower quartile over the frames, pixel by pixel: what shines there whichever lamp is on.
cv::Mat1f standing_light(const std::vector<ZoneImage>& images) {
    cv::Mat1f standing(images.front().luminance.size(), 0.0F);
    if (images.size() < 3) return standing;
    std::vector<float> values(images.size());
    const auto quartile = values.begin() + static_cast<std::ptrdiff_t>(images.size() / 4);
    for (int y = 0; y < standing.rows; ++y)
        for (int x = 0; x < standing.cols; ++x) {
            for (std::size_t i = 0; i < images.size(); ++i) values[i] = images[i].luminance(y, x);
            std::nth_element(values.begin(), quartile, values.end());
            standing(y, x) = *quartile;
        }
    return standing;
}

std::vector<ZoneImage> zone_images(const std::vector<cv::Mat3f>& frames) {
    std::vector<ZoneImage> images;
    for (const cv::Mat3f& frame : frames) images.push_back({frame, mean_channel(frame), strongest_channel(frame), {}});
    const cv::Mat1f standing = standing_light(images);
    for (ZoneImage& image : images) image.moving = image.luminance - standing;
    return images;
}

/// Connected pixels above a threshold.
struct Spot {
    int label = 0;
    double weight = 0;
    double area = 0;
    cv::Point2d middle;
};
struct Spots {
    cv::Mat1i labels;
    std::vector<Spot> spots;  ///< those that a lamp's image can be: compact, in the mirror zone; the strongest first
    int others = 0;           ///< those that it cannot be
};

Spots bright_spots(const cv::Mat1f& moving, double threshold, const Zone& zone) {
    Spots found;
    cv::Mat1i stats;
    cv::Mat1d centres;
    const int labels = cv::connectedComponentsWithStats(moving > threshold, found.labels, stats, centres);
    const double limit = std::max(max_small_area_px, max_share_of_zone * zone.area);
    for (int label = 1; label < labels; ++label) {
        Spot spot{label, 0, 1.0 * stats(label, cv::CC_STAT_AREA), {centres(label, 0), centres(label, 1)}};
        const bool in_zone = zone.inside(cv::Point(spot.middle)) != 0;
        if (!in_zone || spot.area > limit) {
            found.others += in_zone;
            continue;
        }
        const cv::Rect box(stats(label, cv::CC_STAT_LEFT), stats(label, cv::CC_STAT_TOP),
                           stats(label, cv::CC_STAT_WIDTH), stats(label, cv::CC_STAT_HEIGHT));
        for (int y = box.y; y < box.br().y; ++y)
            for (int x = box.x; x < box.br().x; ++x)
                if (found.labels(y, x) == label) spot.weight += moving(y, x);
        found.spots.push_back(spot);
    }
    std::stable_sort(found.spots.begin(), found.spots.end(),
                     [](const Spot& a, const Spot& b) { return a.weight > b.weight; });
    return found;
}

double median(std::vector<float> values) {
    if (values.empty()) return 0;
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

/// Standard deviation of the pixels' noise: from the differences of neighbours, most of which see no edge.
double noise_of(const cv::Mat1f& image, const cv::Mat1b& inside) {
    std::vector<float> differences;
    for (int y = 0; y < image.rows; ++y)
        for (int x = 1; x < image.cols; ++x)
            if (inside(y, x) && inside(y, x - 1)) differences.push_back(std::abs(image(y, x) - image(y, x - 1)));
    return 1.4826 * median(differences) / std::sqrt(2.0);
}

cv::Mat1b grown(const cv::Mat1b& member, int by_px) {
    const cv::Mat disc = cv::getStructuringElement(cv::MORPH_ELLIPSE, {2 * by_px + 1, 2 * by_px + 1});
    cv::Mat1b result;
    cv::dilate(member, result, disc);
    return result;
}

/// Noise of each pixel's luminance: how far its colours are from the whole patch's mixture of them.
std::vector<double> grain_of(const std::vector<cv::Vec3f>& colours) {
    cv::Vec3d sum(0, 0, 0);
    for (const cv::Vec3f& c : colours) sum += cv::Vec3d(c);
    const double all = sum[0] + sum[1] + sum[2];
    std::vector<double> grain;
    for (const cv::Vec3f& c : colours) {
        const double level = double(c[0]) + c[1] + c[2];
        const cv::Vec3d off = cv::Vec3d(c) - level / (all > 0 ? all : 1) * sum;
        grain.push_back(std::sqrt(off.dot(off) / 6));  // three colours less their sum; their mean has a third of it
    }
    return grain;
}

bool clipped(const ZoneImage& image, const cv::Mat1b& where) {
    double strongest = 0;
    cv::minMaxLoc(image.strongest, nullptr, &strongest, nullptr, nullptr, where);
    return strongest >= full_scale && strongest < merged_scale;
}

/// The spot's pixels and its fringe, without other spots; coordinates of the frame.
SpotPatch patch_of(const ZoneImage& image, const Spots& spots, const Spot& spot, const Zone& zone, const Ball& ball) {
    const cv::Mat1b own(spots.labels == spot.label), other((spots.labels > 0) & (spots.labels != spot.label));
    const cv::Mat1b near = grown(own, fringe_px), ring(grown(own, 2 * fringe_px) & ~near & ~other);
    SpotPatch patch;
    const cv::Mat1b mine(near & ~other);
    patch.clipped = clipped(image, mine);
    // What stands still slopes beneath a spot and would draw its centroid; a saturated one is full scale in all.
    const cv::Mat1f& seen = patch.clipped ? image.luminance : image.moving;
    std::vector<float> around;
    std::vector<cv::Vec3f> colours;
    for (int y = 0; y < own.rows; ++y)
        for (int x = 0; x < own.cols; ++x) {
            if (ring(y, x)) around.push_back(seen(y, x));
            if (!mine(y, x)) continue;
            patch.at.emplace_back(x + zone.box.x, y + zone.box.y);
            patch.value.push_back(seen(y, x));
            colours.push_back(image.colour(y, x));
        }
    patch.top = *std::max_element(patch.value.begin(), patch.value.end());
    patch.background = std::min(median(around), 0.5 * patch.top);
    patch.noise = noise_of(seen, zone.inside);
    patch.grain = grain_of(colours);
    const cv::Point2d out = spot.middle + cv::Point2d(zone.box.tl()) - cv::Point2d(ball.x, ball.y);
    const double length = cv::norm(out);
    if (length > 0) patch.narrow = out / length;
    patch.roundness = 1 - std::min(0.7, length * length / (ball.radius * ball.radius));
    return patch;
}

/// Where the lamp's middle is mirrored. The mirror image of a disc of angular radius a has its centroid nearer to the
/// ball's middle: a ball seen from afar maps solid angle to area evenly, so the centroid is the mean over the disc of
/// n_xy, which is n_xy (1 - a^2 / 8 (4 - 3 s^2) / (4 (1 - s^2))) with s = |n_xy| to the second order in a.
cv::Point2d middle_of_lamp(const SpotMeasure& spot, const Ball& ball) {
    const cv::Point2d centre(ball.x, ball.y), out = spot.at - centre;
    const double ss = std::min(0.6, out.dot(out) / (ball.radius * ball.radius));
    const double a = std::min(0.3, 2 * spot.radius_px / ball.radius);
    const double share = spot.windowed ? windowed_share : 1;
    return centre + out * (1 + share * a * a / 8 * (4 - 3 * ss) / (4 * (1 - ss)));
}

Highlight highlight_at(const SpotPatch& patch, const Ball& ball) {
    const SpotMeasure spot = measure_spot(patch);
    const cv::Point2d at = middle_of_lamp(spot, ball);
    return {at.x, at.y, spot.sigma_px, patch.clipped};
}

double peak_of(const ZoneImage& image, const Zone& zone) {
    cv::Mat1f smooth;  // one hot pixel is not a peak
    cv::GaussianBlur(image.moving, smooth, {}, 0.7);
    double peak = 0;
    cv::minMaxLoc(smooth, nullptr, &peak, nullptr, nullptr, zone.inside);
    return peak;
}

/// A frame's candidates before the frames are compared.
struct FrameSpots {
    double peak = 0;
    Spots bright;  ///< above half the peak
    Spots faint;   ///< above the share that another lamp must have
};

FrameSpots spots_of(const ZoneImage& image, const Zone& zone) {
    FrameSpots frame;
    frame.peak = peak_of(image, zone);
    if (frame.peak < least_peak) return frame;
    frame.bright = bright_spots(image.moving, frame.peak / 2, zone);
    frame.faint = bright_spots(image.moving, least_share_of_other * frame.peak, zone);
    return frame;
}

/// How many other frames have a spot in the same place.
int shared_with(const std::vector<FrameSpots>& frames, std::size_t own, const Spot& spot) {
    const double near = 1 + 1.5 * std::sqrt(spot.area / CV_PI);
    int count = 0;
    for (std::size_t i = 0; i < frames.size(); ++i)
        count += i != own && std::any_of(frames[i].bright.spots.begin(), frames[i].bright.spots.end(),
                                         [&](const Spot& s) { return cv::norm(s.middle - spot.middle) < near; });
    return count;
}

/// The spot that is this frame's alone: light that leaks from another lamp shows in that lamp's frame as well.
const Spot* own_spot(const std::vector<FrameSpots>& frames, std::size_t own) {
    const Spot* best = nullptr;
    int least = 0;
    for (const Spot& spot : frames[own].bright.spots) {
        const int shared = shared_with(frames, own, spot);
        if (best && shared >= least) continue;
        best = &spot;
        least = shared;
    }
    return best;
}

/// Spots apart from the lamp's that are like it: not its own flare, not specks.
int spots_like(const Spots& faint, const Spots& bright, const Spot& lamp) {
    const int lamp_label = faint.labels(cv::Point(lamp.middle));
    return static_cast<int>(
               std::count_if(faint.spots.begin(), faint.spots.end(),
                             [&](const Spot& s) { return s.label != lamp_label && s.area >= lamp.area / 3; })) +
           bright.others;
}

HighlightReading read_frame(const std::vector<ZoneImage>& images, const std::vector<FrameSpots>& frames, std::size_t i,
                            double usual, const Zone& zone, const Ball& ball) {
    const FrameSpots& frame = frames[i];
    if (frame.peak < least_peak) return {std::nullopt, "the ball shows no bright spot", 0};
    if (frame.peak < least_peak_of_median * usual)
        return {std::nullopt, "the brightest spot on the ball is far dimmer than in the other frames", 0};
    const Spot* lamp = own_spot(frames, i);
    if (!lamp && frame.bright.others == 0)
        return {std::nullopt, "the ball shines at its rim only, which mirrors what stands behind it", 0};
    if (!lamp) return {std::nullopt, "what shines on the ball is too large to be a lamp", frame.bright.others};
    return {highlight_at(patch_of(images[i], frame.bright, *lamp, zone, ball), ball), "",
            spots_like(frame.faint, frame.bright, *lamp)};
}

}  // namespace

cv::Rect mirror_box(const Ball& ball, cv::Size frame) {
    const double half = mirror_zone * ball.radius + margin_px;
    const cv::Point from(static_cast<int>(std::floor(ball.x - half)), static_cast<int>(std::floor(ball.y - half)));
    const cv::Point to(static_cast<int>(std::ceil(ball.x + half)) + 1, static_cast<int>(std::ceil(ball.y + half)) + 1);
    return cv::Rect(from, to) & cv::Rect({}, frame);
}

std::vector<HighlightReading> find_highlights(const std::vector<cv::Mat3f>& frames, const Ball& ball) {
    BallParts parts{mirror_box(ball, frames.front().size()), {}};
    for (const cv::Mat3f& frame : frames) parts.frames.push_back(frame(parts.box));
    return find_highlights(parts, ball);
}

std::vector<HighlightReading> find_highlights(const BallParts& parts, const Ball& ball) {
    const Zone zone = mirror_zone_of(ball, parts.box);
    const std::vector<ZoneImage> images = zone_images(parts.frames);
    std::vector<FrameSpots> spots;
    std::vector<float> peaks;
    for (const ZoneImage& image : images) {
        spots.push_back(spots_of(image, zone));
        peaks.push_back(static_cast<float>(spots.back().peak));
    }
    const double usual = median(peaks);
    std::vector<HighlightReading> readings;
    for (std::size_t i = 0; i < images.size(); ++i) readings.push_back(read_frame(images, spots, i, usual, zone, ball));
    return readings;
}

std::vector<HighlightReading> find_brightest(const BallParts& parts, const Ball& ball) {
    const Zone zone = mirror_zone_of(ball, parts.box);
    std::vector<HighlightReading> readings;
    for (const cv::Mat3f& frame : parts.frames) {
        cv::Mat1f image = mean_channel(frame);
        image.setTo(0, zone.inside == 0);
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
