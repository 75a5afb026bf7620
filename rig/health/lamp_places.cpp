#include "rig/health/lamp_places.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <set>

#include "processing/calibration/ball_photographs.h"
#include "processing/calibration/ball_search.h"
#include "processing/calibration/highlight.h"
#include "processing/calibration/locate.h"
#include "processing/calibration/reflect.h"

namespace darkbox {
namespace {

constexpr std::size_t most_searched = 12;  ///< frames in which the ball is looked for
constexpr double outline_sigma_px = 0.25;  ///< of the outline, lamp by lamp: what all share is a turn of the whole
constexpr double knock_worth_words_deg = 2.0;
constexpr double fewest_in_place = 0.5;
constexpr double fewest_explained = 0.8;

cv::Mat3f as_colour(const cv::Mat1f& light) {
    cv::Mat3f colour;
    cv::merge(std::vector<cv::Mat>{light, light, light}, colour);
    return colour;
}

/// Evenly spread over all.
std::vector<cv::Mat3f> searched(const std::vector<LampPicture>& pictures) {
    const std::size_t count = std::min(pictures.size(), most_searched);
    std::vector<cv::Mat3f> frames;
    for (std::size_t i = 0; i < count; ++i) frames.push_back(as_colour(pictures[i * pictures.size() / count].light));
    return frames;
}

std::optional<Ball> ball_in(const std::vector<LampPicture>& pictures) {
    const std::vector<cv::Mat3f> frames = searched(pictures);
    const std::vector<Ball> found = find_balls(frames);
    if (found.empty()) return std::nullopt;
    CalibrationOptions options;
    options.balls = {found.front()};  // its outline is then fitted
    BallFramesInMemory in_memory(frames);
    return locate_balls(in_memory, options).front().ball;
}

std::vector<std::optional<Highlight>> highlights_of(const std::vector<LampPicture>& pictures, const Ball& ball) {
    BallParts parts{mirror_box(ball, pictures.front().light.size()), {}};
    for (const LampPicture& picture : pictures) parts.frames.push_back(as_colour(picture.light(parts.box)));
    std::vector<std::optional<Highlight>> highlights;
    for (HighlightReading& reading : find_highlights(parts, ball)) highlights.push_back(reading.highlight);
    return highlights;
}

/// Of the small pictures; pixels are the unit where the description tells no scale and the ball's size is not known.
ViewGeometry view_of(const RigDescription& rig, const LampPicture& picture, const Ball& ball) {
    const auto small = [&](double pixel) { return (pixel + 0.5) / picture.factor - 0.5; };
    const CameraDescription& camera = rig.camera;
    ViewGeometry view;
    view.principal = {0.5 * (picture.light.cols - 1), 0.5 * (picture.light.rows - 1)};
    if (camera.principal_px) view.principal = {small((*camera.principal_px)[0]), small((*camera.principal_px)[1])};
    if (camera.mm_per_pixel)
        view.mm_per_pixel = *camera.mm_per_pixel * picture.factor;
    else if (rig.ball_diameter_mm)
        view.mm_per_pixel = *rig.ball_diameter_mm / (2 * ball.radius);
    if (camera.distance_mm && (camera.mm_per_pixel || rig.ball_diameter_mm)) view.distance_mm = *camera.distance_mm;
    return view;
}

Eigen::Matrix3d across(const Eigen::Vector3d& direction, double sigma_deg) {
    const double sigma = sigma_deg * std::numbers::pi / 180;
    return sigma * sigma * (Eigen::Matrix3d::Identity() - direction * direction.transpose());
}

/// Directions as they are at the ball.
RigLights seen_from(const std::optional<Eigen::Vector3d>& ball_mm, const KnownLamps& known) {
    RigLights lights = known.lights;
    lights.intensities_known = false;
    for (Light& light : lights.lights) {
        if (light.near && ball_mm) light = held_at(std::move(light), *ball_mm);
        light.near.reset();
        light.covariance = across(light.direction, known.sigma_deg);
    }
    return lights;
}

bool each_others(const LampDrift& a, const LampDrift& b) { return a.partner == b.lamp && b.partner == a.lamp; }

/// The lamps that are in their places, or in one that another left.
bool is_told_by_a_ball(const Drift& drift) {
    double read = 0, steady = 0, exchanged = 0;
    for (const LampDrift& lamp : drift.lamps) {
        if (lamp.finding == LampFinding::unread || lamp.finding == LampFinding::dead) continue;
        ++read;
        steady += lamp.finding == LampFinding::steady ? 1 : 0;
        exchanged += lamp.finding == LampFinding::swapped ? 1 : 0;
    }
    return read >= 3 && (steady >= fewest_in_place * read || steady + exchanged >= fewest_explained * read);
}

PlaceFinding about(const LampDrift& lamp, const std::vector<LampDrift>& lamps, const KnownLamps& known) {
    const auto partner = std::ranges::find(lamps, lamp.partner, &LampDrift::lamp);
    if (lamp.finding == LampFinding::duplicate)
        return {{lamp.lamp},
                fmt::format("{} shines from where {} stands by {}, as {} does: look for one lamp on both outputs, in "
                            "their wiring and in rig.toml",
                            lamp.lamp, lamp.partner, known.source, lamp.partner)};
    if (partner != lamps.end() && each_others(lamp, *partner))
        return {{lamp.lamp, lamp.partner},
                fmt::format("{} and {} are exchanged: each shines from where the other stands by {}; correct their "
                            "wiring, or their outputs in rig.toml, and take both again",
                            lamp.lamp, lamp.partner, known.source)};
    return {{lamp.lamp},
            fmt::format("{} shines from where {} stands by {}: lamps are exchanged in a ring; correct their wiring, or "
                        "their outputs in rig.toml, and take them again",
                        lamp.lamp, lamp.partner, known.source)};
}

}  // namespace

std::optional<BallPlaces> places_on_ball(const std::vector<LampPicture>& pictures, const RigDescription& rig) {
    if (pictures.size() < 3) return std::nullopt;  // find_balls() tells a ball by glints that move
    const auto ball = ball_in(pictures);
    if (!ball) return std::nullopt;
    const ViewGeometry view = view_of(rig, pictures.front(), *ball);
    const auto radius_mm = rig.ball_diameter_mm ? std::optional(*rig.ball_diameter_mm / 2) : std::nullopt;
    const MirrorSphere sphere = sphere_of(view, *ball, radius_mm);
    const bool has_scale = rig.camera.mm_per_pixel || rig.ball_diameter_mm;
    BallPlaces places{*ball, {{rig.name, {}}, {}, false}, {}};
    const double factor = pictures.front().factor;
    places.ball.x = (ball->x + 0.5) * factor - 0.5;
    places.ball.y = (ball->y + 0.5) * factor - 0.5;
    places.ball.radius *= factor;
    if (has_scale) places.ball_mm = sphere.centre_mm;
    // Half of the angle between view and light is the normal's.
    const double sigma_deg = 2 * outline_sigma_px / ball->radius * 180 / std::numbers::pi;
    const auto highlights = highlights_of(pictures, *ball);
    for (std::size_t i = 0; i < pictures.size(); ++i) {
        Light light;
        light.file = pictures[i].lamp;
        const auto seen = highlights[i] ? reflect_at(view, sphere, {highlights[i]->u, highlights[i]->v}) : std::nullopt;
        light.used = seen.has_value();
        if (seen) {
            light.direction = seen->direction;
            light.covariance = across(light.direction, sigma_deg);
        }
        places.lights.rig.lamps.push_back(pictures[i].lamp);
        places.lights.lights.push_back(light);
    }
    return places;
}

std::vector<PlaceFinding> compare_places(const BallPlaces& seen, const KnownLamps& known) {
    DriftOptions options;
    options.same_place_deg = known.moved_deg;
    options.other_rig = OtherRig::compare;  // of the same name: see known_lamps.h
    const Drift drift = drift_between(seen_from(seen.ball_mm, known), seen.lights, options);
    if (!is_told_by_a_ball(drift)) return {};
    std::vector<PlaceFinding> findings;
    std::set<std::string> told;
    for (const LampDrift& lamp : drift.lamps) {
        if (told.contains(lamp.lamp)) continue;
        if (lamp.finding == LampFinding::swapped || lamp.finding == LampFinding::duplicate) {
            findings.push_back(about(lamp, drift.lamps, known));
            told.insert(findings.back().unlike.begin(), findings.back().unlike.end());
        } else if (lamp.finding == LampFinding::moved && lamp.moved_deg > known.moved_deg) {
            findings.push_back({{},
                                fmt::format("{} moved: it shines from {:.1f} degrees beside where it stands by {}; put "
                                            "it back, or calibrate anew",
                                            lamp.lamp, lamp.moved_deg, known.source)});
        }
    }
    if (drift.knock && known.camera_known && drift.knock->angle_deg > knock_worth_words_deg)
        findings.push_back({{},
                            fmt::format("all lamps shine from {:.1f} degrees beside where they stand by {}: the camera "
                                        "was knocked, or the dome as a whole; calibrate anew",
                                        drift.knock->angle_deg, known.source)});
    return findings;
}

}  // namespace darkbox
