#include "processing/calibration/drift.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "acquisition/frame/error.h"
#include "processing/calibration/common_rotation.h"
#include "processing/calibration/drift_words.h"

namespace darkbox {
namespace {

double radians(double degrees) { return degrees * std::numbers::pi / 180.0; }

/// A lamp that both calibrations know, with its place in each.
struct Match {
    std::size_t before = 0;
    std::size_t after = 0;
    std::string lamp;
};

std::string lamp_name(const RigLights& rig, std::size_t light) {
    const std::string known = light < rig.rig.lamps.size() ? rig.rig.lamps[light] : "";
    return known.empty() ? rig.lights[light].file : known;
}

std::optional<std::size_t> place_of(const std::string& lamp, const RigLights& rig) {
    for (std::size_t i = 0; i < rig.lights.size(); ++i)
        if (!lamp.empty() && lamp_name(rig, i) == lamp) return i;
    return std::nullopt;
}

std::vector<Match> matched_by_name(const RigLights& before, const RigLights& after, Drift& drift) {
    std::vector<Match> matches;
    for (std::size_t i = 0; i < before.lights.size(); ++i) {
        const std::string lamp = lamp_name(before, i);
        if (const auto place = place_of(lamp, after))
            matches.push_back({i, *place, lamp});
        else
            drift.only_before.push_back(lamp);
    }
    for (std::size_t i = 0; i < after.lights.size(); ++i)
        if (!place_of(lamp_name(after, i), before)) drift.only_after.push_back(lamp_name(after, i));
    return matches;
}

std::vector<Match> matched_by_place(const RigLights& before, const RigLights& after) {
    if (before.lights.size() != after.lights.size())
        throw InputError(fmt::format("the calibrations have {} and {} lights and no lamp's name in common",
                                     before.lights.size(), after.lights.size()),
                         "compare calibrations of the same lamps");
    std::vector<Match> matches;
    for (std::size_t i = 0; i < before.lights.size(); ++i) matches.push_back({i, i, lamp_name(before, i)});
    return matches;
}

std::vector<Match> matched(const RigLights& before, const RigLights& after, const DriftOptions& options, Drift& drift) {
    const std::string different = difference(before.rig, after.rig);
    if (!different.empty() && options.other_rig == OtherRig::refuse)
        throw InputError(different, "compare calibrations of one rig, or say --any-rig");
    std::vector<Match> matches = matched_by_name(before, after, drift);
    if (!matches.empty()) return matches;
    drift.only_before.clear();
    drift.only_after.clear();
    return matched_by_place(before, after);
}

/// A distant light's direction holds everywhere, a near lamp's at one point: only like can be compared, and near lamps
/// as seen from the same point.
RigLights seen_alike(const RigLights& before, RigLights after, const std::vector<Match>& matches) {
    for (const Match& match : matches) {
        const Light& a = before.lights[match.before];
        Light& b = after.lights[match.after];
        if (!a.used || !b.used) continue;
        if (a.near.has_value() != b.near.has_value())
            throw InputError(
                fmt::format("the calibrations cannot be compared: one has {} as a near lamp, the other as a distant "
                            "one, and their directions hold at different places",
                            match.lamp),
                "calibrate both with --lamps near, or both with --lamps distant");
        if (a.near) b = held_at(std::move(b), a.near->object_mm);
    }
    return after;
}

/// The light's covariance, or what is assumed where it is not known.
Eigen::Matrix3d covariance_of(const Light& light, const DriftOptions& options) {
    if (light.sigma_deg() > 0) return light.covariance;
    const double sigma = radians(options.unknown_sigma_deg);
    return sigma * sigma * (Eigen::Matrix3d::Identity() - light.direction * light.direction.transpose());
}

/// Chance that chi-squared of three degrees of freedom is so large.
double p_of_three(double chi_squared) {
    return std::erfc(std::sqrt(chi_squared / 2)) +
           std::sqrt(2 * chi_squared / std::numbers::pi) * std::exp(-chi_squared / 2);
}

/// None unless the rotation exceeds what the lamps' uncertainty explains even where all err alike.
std::optional<CameraKnock> knock_of(const CommonRotation& common, double false_alarm) {
    const Eigen::Vector3d turn = common.vector_deg();
    const Eigen::Vector3d turn_rad = turn * std::numbers::pi / 180;
    const double followers = static_cast<double>(common.followers());
    CameraKnock knock{turn.norm(), turn.normalized(), common.followers(), 1};
    knock.p_value = p_of_three(turn_rad.dot(common.information / followers * turn_rad));
    return knock.p_value < false_alarm ? std::optional(knock) : std::nullopt;
}

/// The comparison at work: what belongs to lamp i stands at place i of each vector.
struct Comparison {
    const RigLights& before;
    const RigLights& after;
    const DriftOptions& options;
    std::vector<Match> matches;
    std::vector<std::size_t> read;     ///< places in `matches` of the lamps that both calibrations read
    std::vector<DirectionPair> pairs;  ///< by place in `read`
    std::optional<CommonRotation> common;

    const Light& light_before(const Match& match) const { return before.lights[match.before]; }
    const Light& light_after(const Match& match) const { return after.lights[match.after]; }
    Eigen::Matrix3d rotation() const { return common ? common->after_from_before : Eigen::Matrix3d::Identity(); }
};

void pair_directions(Comparison& c) {
    for (std::size_t i = 0; i < c.matches.size(); ++i) {
        const Light &a = c.light_before(c.matches[i]), &b = c.light_after(c.matches[i]);
        if (!a.used || !b.used) continue;
        c.read.push_back(i);
        c.pairs.push_back({a.direction, b.direction, covariance_of(a, c.options) + covariance_of(b, c.options)});
    }
}

/// The chance allowed to each of so many judgements.
double chance_each(const DriftOptions& options, std::size_t judgements) {
    return 1 - std::pow(1 - options.false_alarm, 1 / static_cast<double>(std::max<std::size_t>(1, judgements)));
}

/// A near lamp's distance from the object.
struct Distance {
    double mm = 0;
    double variance = 0;  ///< mm^2; 0: not known
};

Distance distance_of(const LampPosition& lamp, const Eigen::Vector3d& object_mm) {
    const Eigen::Vector3d ray = lamp.position_mm - object_mm;
    const Eigen::Vector3d unit = ray.normalized();
    return {ray.norm(), unit.dot(lamp.covariance_mm2 * unit)};
}

struct DistancePair {
    std::size_t match = 0;  ///< place in Comparison::matches
    Distance before, after;
};

std::vector<DistancePair> pair_distances(const Comparison& c) {
    std::vector<DistancePair> pairs;
    for (const std::size_t i : c.read) {
        const auto &a = c.light_before(c.matches[i]).near, &b = c.light_after(c.matches[i]).near;
        if (a && b) pairs.push_back({i, distance_of(*a, a->object_mm), distance_of(*b, a->object_mm)});
    }
    return pairs;
}

/// What all distances grew by: the scale was read otherwise, off one ball for all lamps.
double common_scale(const std::vector<DistancePair>& pairs) {
    std::vector<double> ratios;
    for (const DistancePair& pair : pairs) ratios.push_back(pair.after.mm / std::max(pair.before.mm, 1e-9));
    const auto middle = ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2);
    std::nth_element(ratios.begin(), middle, ratios.end());
    return *middle;
}

/// Near lamps that moved along the line on which they are seen: no direction tells.
void judge_distances(const Comparison& c, std::vector<LampDrift>& lamps) {
    const std::vector<DistancePair> pairs = pair_distances(c);
    if (pairs.empty()) return;
    const double scale = common_scale(pairs);
    const double allowed = chance_each(c.options, c.pairs.size() + pairs.size());
    for (const DistancePair& pair : pairs) {
        LampDrift& lamp = lamps[pair.match];
        lamp.farther_mm = pair.after.mm - scale * pair.before.mm;
        if (!(pair.before.variance > 0 && pair.after.variance > 0)) continue;
        lamp.farther_sigma_mm = std::sqrt(pair.after.variance + scale * scale * pair.before.variance);
        const double chance = std::erfc(std::abs(*lamp.farther_mm) / (std::numbers::sqrt2 * lamp.farther_sigma_mm));
        if (chance < allowed && lamp.finding == LampFinding::steady) lamp.finding = LampFinding::moved;
    }
}

/// Each lamp by itself: how far, and whether by chance.
void judge_movement(const Comparison& c, std::vector<LampDrift>& lamps) {
    const double per_lamp = chance_each(c.options, c.pairs.size() + pair_distances(c).size());
    for (std::size_t i = 0; i < c.pairs.size(); ++i) {
        LampDrift& lamp = lamps[c.read[i]];
        const auto others = c.common ? without(*c.common, c.pairs, i) : std::nullopt;
        const Eigen::Matrix3d extra =
            others ? covariance_through(*others, c.pairs[i].before) : Eigen::Matrix3d::Zero().eval();
        const Mismatch found = mismatch(c.pairs[i], others ? others->after_from_before : c.rotation(), extra);
        lamp.moved_deg = found.angle_deg;
        lamp.p_value = found.p_value();
        lamp.sigma_deg = std::sqrt((c.pairs[i].covariance + extra).trace() / 2) * 180 / std::numbers::pi;
        if (lamp.p_value < per_lamp) lamp.finding = LampFinding::moved;
    }
}

/// The read lamp whose old place lamp `i` shines from now; nearest, and not its own.
std::optional<std::size_t> taken_place(const Comparison& c, std::size_t i, double sigma_deg) {
    std::optional<std::size_t> taken;
    double nearest = std::max(c.options.same_place_deg, 3 * sigma_deg);
    for (std::size_t j = 0; j < c.pairs.size(); ++j) {
        const double angle = angle_deg(c.pairs[i].after, c.rotation() * c.pairs[j].before);
        if (j == i || angle > nearest) continue;
        nearest = angle;
        taken = j;
    }
    return taken;
}

/// Of the lamps that moved: whose places they took.
void tell_swaps_apart(const Comparison& c, std::vector<LampDrift>& lamps) {
    std::vector<std::optional<std::size_t>> taken(c.pairs.size());
    const auto lamp = [&](std::size_t i) -> LampDrift& { return lamps[c.read[i]]; };
    for (std::size_t i = 0; i < c.pairs.size(); ++i)
        if (lamp(i).finding == LampFinding::moved) taken[i] = taken_place(c, i, lamp(i).sigma_deg);
    for (std::size_t i = 0; i < c.pairs.size(); ++i) {
        if (!taken[i]) continue;
        lamp(i).partner = lamp(*taken[i]).lamp;
        if (taken[*taken[i]])
            lamp(i).finding = LampFinding::swapped;
        else if (lamp(*taken[i]).finding == LampFinding::steady)
            lamp(i).finding = LampFinding::duplicate;
    }
}

/// Lamps that moved to one and the same new place.
void tell_new_duplicates(const Comparison& c, std::vector<LampDrift>& lamps) {
    for (std::size_t i = 0; i < c.pairs.size(); ++i)
        for (std::size_t j = 0; j < c.pairs.size(); ++j) {
            LampDrift& lamp = lamps[c.read[i]];
            const LampDrift& other = lamps[c.read[j]];
            if (i == j || lamp.finding != LampFinding::moved) continue;
            if (other.finding != LampFinding::moved && other.finding != LampFinding::duplicate) continue;
            if (angle_deg(c.pairs[i].after, c.pairs[j].after) > c.options.same_place_deg) continue;
            lamp.finding = LampFinding::duplicate;
            lamp.partner = other.lamp;
        }
}

void judge_intensities(const Comparison& c, std::vector<LampDrift>& lamps) {
    if (!c.before.intensities_known || !c.after.intensities_known || c.read.empty()) return;
    std::vector<double> ratios;
    for (const std::size_t i : c.read)
        ratios.push_back(c.light_after(c.matches[i]).intensity.mean() /
                         std::max(c.light_before(c.matches[i]).intensity.mean(), 1e-12));
    std::vector<double> sorted = ratios;
    const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
    std::nth_element(sorted.begin(), middle, sorted.end());
    for (std::size_t i = 0; i < c.read.size(); ++i) {
        LampDrift& lamp = lamps[c.read[i]];
        lamp.intensity_ratio = ratios[i] / std::max(*middle, 1e-12);
        if (*lamp.intensity_ratio < c.options.dead_ratio)
            lamp.finding = LampFinding::dead;
        else if (*lamp.intensity_ratio < c.options.dim_ratio && lamp.finding == LampFinding::steady)
            lamp.finding = LampFinding::dim;
    }
}

std::vector<LampDrift> lamps_as_stored(const Comparison& c) {
    std::vector<LampDrift> lamps;
    for (const Match& match : c.matches) {
        const Light &a = c.light_before(match), &b = c.light_after(match);
        LampDrift lamp;
        lamp.lamp = match.lamp;
        lamp.sigma_assumed = !(a.sigma_deg() > 0 && b.sigma_deg() > 0);
        if (a.used && b.used)
            lamp.raw_deg = angle_deg(a.direction, b.direction);
        else
            lamp.finding = a.used ? LampFinding::dead : LampFinding::unread;
        lamps.push_back(lamp);
    }
    return lamps;
}

void require_ratio(const char* field, double value) {
    if (!(value >= 0 && value < 1))
        throw InputError(fmt::format("{} is {}", field, value), "allowed: 0 or more, less than 1");
}

}  // namespace

void DriftOptions::validate() const {
    if (!(false_alarm > 0 && false_alarm < 1))
        throw InputError(fmt::format("false_alarm is {}", false_alarm), "allowed: between 0 and 1");
    if (!(unknown_sigma_deg > 0 && unknown_sigma_deg <= 45))
        throw InputError(fmt::format("unknown_sigma_deg is {}", unknown_sigma_deg), "allowed: above 0, at most 45");
    if (!(same_place_deg > 0 && same_place_deg <= 45))
        throw InputError(fmt::format("same_place_deg is {}", same_place_deg), "allowed: above 0, at most 45");
    require_ratio("dim_ratio", dim_ratio);
    require_ratio("dead_ratio", dead_ratio);
}

Drift drift_between(const RigLights& before, const RigLights& after, const DriftOptions& options) {
    options.validate();
    Drift drift;
    std::vector<Match> matches = matched(before, after, options, drift);
    const RigLights alike = seen_alike(before, after, matches);
    Comparison c{before, alike, options, std::move(matches), {}, {}, std::nullopt};
    pair_directions(c);
    c.common = common_rotation(c.pairs);
    if (c.common) drift.knock = knock_of(*c.common, options.false_alarm);
    if (!drift.knock) c.common.reset();
    drift.lamps = lamps_as_stored(c);
    judge_movement(c, drift.lamps);
    tell_swaps_apart(c, drift.lamps);
    tell_new_duplicates(c, drift.lamps);
    judge_distances(c, drift.lamps);
    judge_intensities(c, drift.lamps);
    drift.findings = words_of(drift);
    return drift;
}

}  // namespace darkbox
