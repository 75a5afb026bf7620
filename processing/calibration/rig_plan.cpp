#include "processing/calibration/rig_plan.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "acquisition/frame/error.h"
#include "processing/calibration/normal_error.h"

namespace darkbox {
namespace {

constexpr int fewest_lamps = 3;
constexpr int most_lamps = 64;
constexpr double nearest_mm = 10;  // what rig.toml allows
constexpr double farthest_mm = 100'000;
constexpr double triad_elevation_deg = 35.2644;  // of an orthogonal triad around the view axis: atan(1 / sqrt 2)
constexpr double naive_elevation_deg = 45;

constexpr int normals_planned_for = 1000;
constexpr std::array<double, 8> steps_deg{16, 8, 4, 2, 1, 0.5, 0.25, 0.125};
constexpr int sweeps_per_step = 12;
constexpr double least_gain = 1e-9;  // relative; what a move must bring
constexpr double tie = 1e-6;         // relative; of two starts this near the first is taken

double radians(double degrees) { return degrees * std::numbers::pi / 180.0; }

/// A lamp's place on the dome.
struct Place {
    double elevation_deg = 0;
    double azimuth_deg = 0;

    Eigen::Vector3d direction() const {
        const double e = radians(elevation_deg), a = radians(azimuth_deg);
        return {std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e)};
    }
};
using Places = std::vector<Place>;

/// The part of the dome where lamps may hang, and how near to each other.
struct Zone {
    double low_deg, high_deg;
    double separation_deg;

    double clamp(double elevation_deg) const { return std::clamp(elevation_deg, low_deg, high_deg); }

    bool allows(const Places& places, std::size_t lamp, const Place& place) const {
        const double nearest = std::cos(radians(separation_deg));
        const Eigen::Vector3d direction = place.direction();
        for (std::size_t other = 0; other < places.size(); ++other)
            if (other != lamp && direction.dot(places[other].direction()) > nearest) return false;
        return true;
    }
    bool allows(const Places& places) const {
        for (std::size_t lamp = 0; lamp < places.size(); ++lamp)
            if (!allows(places, lamp, places[lamp])) return false;
        return true;
    }
};

double zone_height(const RigPlanOptions& options) {
    return std::sin(radians(options.max_elevation_deg)) - std::sin(radians(options.min_elevation_deg));
}

Zone zone_of(const RigPlanOptions& options) {
    const double area = 2 * std::numbers::pi * zone_height(options);
    const double even_deg = std::sqrt(area / options.lamps) * 180 / std::numbers::pi;
    return {options.min_elevation_deg, options.max_elevation_deg, options.min_separation_deg.value_or(even_deg / 2)};
}

Places ring(int lamps, double elevation_deg) {
    Places places;
    for (int i = 0; i < lamps; ++i) places.push_back({elevation_deg, 360.0 * i / lamps});
    return places;
}

/// Fibonacci's spiral over the zone, even for any number of lamps; drawn in from the zone's borders by half a step.
Places spiral(const RigPlanOptions& options) {
    const double golden_angle_deg = 180 * (3.0 - std::sqrt(5.0));
    Places places;
    for (int i = 0; i < options.lamps; ++i) {
        const double height =
            std::sin(radians(options.min_elevation_deg)) + zone_height(options) * (i + 0.5) / options.lamps;
        places.push_back({std::asin(height) * 180 / std::numbers::pi, golden_angle_deg * i});
    }
    return places;
}

/// The mean predicted error, kept up to date while single lamps move.
class Criterion {
public:
    Criterion(const Places& places, PlanShadows shadows)
        : shadows_(shadows),
          normals_(visible_normals(normals_planned_for)),
          information_(normals_.size(), Eigen::Matrix3d::Zero()) {
        for (const Place& place : places) add(place.direction(), 1);
        value_ = mean(Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero());
    }

    double value() const { return value_; }

    /// Moves the lamp if that lowers the mean.
    bool improves(const Place& from, const Place& to) {
        const Eigen::Vector3d old_direction = from.direction(), new_direction = to.direction();
        const double moved = mean(old_direction, new_direction);
        if (!(moved < value_ * (1 - least_gain))) return false;
        add(old_direction, -1);
        add(new_direction, 1);
        value_ = moved;
        return true;
    }

private:
    bool lit(std::size_t normal, const Eigen::Vector3d& lamp) const {
        return shadows_ == PlanShadows::ignored || normals_[normal].dot(lamp) > 0;
    }
    void add(const Eigen::Vector3d& lamp, double sign) {
        for (std::size_t i = 0; i < normals_.size(); ++i)
            if (lit(i, lamp)) information_[i] += sign * lamp * lamp.transpose();
    }
    double mean(const Eigen::Vector3d& without, const Eigen::Vector3d& with) const {
        double sum = 0;
        for (std::size_t i = 0; i < normals_.size(); ++i) {
            Eigen::Matrix3d information = information_[i];
            if (lit(i, without)) information -= without * without.transpose();
            if (lit(i, with)) information += with * with.transpose();
            sum += normal_error_deg(information, normals_[i], reference_noise);
        }
        return sum / static_cast<double>(normals_.size());
    }

    PlanShadows shadows_;
    std::vector<Eigen::Vector3d> normals_;
    std::vector<Eigen::Matrix3d> information_;  ///< by normal
    double value_ = 0;
};

/// The eight neighbours of a place, `step_deg` away, inside the zone.
std::array<Place, 8> neighbours(const Place& place, double step_deg, const Zone& zone) {
    const double along = step_deg / std::max(std::cos(radians(place.elevation_deg)), 0.05);
    std::array<Place, 8> around;
    std::size_t next = 0;
    for (const int up : {-1, 0, 1})
        for (const int aside : {-1, 0, 1})
            if (up != 0 || aside != 0)
                around[next++] = {zone.clamp(place.elevation_deg + up * step_deg), place.azimuth_deg + aside * along};
    return around;
}

struct Candidate {
    Places places;
    double error_deg = 0;
};

Candidate descend(Places places, const Zone& zone, PlanShadows shadows, const WorkContext& work) {
    Criterion criterion(places, shadows);
    for (const double step : steps_deg) {
        bool moved = true;
        for (int sweep = 0; sweep < sweeps_per_step && moved; ++sweep) {
            if (work.cancelled()) throw Cancelled("planning the rig was stopped", "run the same command again");
            moved = false;
            for (std::size_t lamp = 0; lamp < places.size(); ++lamp)
                for (const Place& place : neighbours(places[lamp], step, zone))
                    if (zone.allows(places, lamp, place) && criterion.improves(places[lamp], place)) {
                        places[lamp] = place;
                        moved = true;
                    }
        }
    }
    return {places, criterion.value()};
}

/// The best of all starts that fit.
Candidate best_plan(const RigPlanOptions& options, const Zone& zone, PlanShadows shadows, const WorkContext& work) {
    const std::array<Places, 2> starts{ring(options.lamps, zone.clamp(triad_elevation_deg)), spiral(options)};
    std::optional<Candidate> best;
    for (std::size_t start = 0; start < starts.size(); ++start) {
        work.tell({"planning lamps", start, starts.size(), ""});
        if (!zone.allows(starts[start])) continue;
        Candidate candidate = descend(starts[start], zone, shadows, work);
        if (!best || candidate.error_deg < best->error_deg * (1 - tie)) best = std::move(candidate);
    }
    work.tell({"planning lamps", starts.size(), starts.size(), ""});
    if (best) return *best;
    throw InputError(
        fmt::format("{} lamps do not fit {:.3g} degrees apart between {:.3g} and {:.3g} degrees of elevation",
                    options.lamps, zone.separation_deg, zone.low_deg, zone.high_deg),
        "allow them nearer to each other, or a wider range of elevation");
}

/// From the highest lamp down, then around: the order in which people wire and read them.
void sort_for_reading(Places& places) {
    for (Place& place : places) place.azimuth_deg -= 360 * std::floor(place.azimuth_deg / 360);
    std::sort(places.begin(), places.end(), [](const Place& a, const Place& b) {
        return std::pair(-a.elevation_deg, a.azimuth_deg) < std::pair(-b.elevation_deg, b.azimuth_deg);
    });
}

Lights lights_at(const Places& places) {
    Lights lights(places.size());
    for (std::size_t i = 0; i < places.size(); ++i) lights[i].direction = places[i].direction();
    return lights;
}

void require_between(const char* field, double value, double low, double high, const char* unit) {
    if (!(value >= low && value <= high))
        throw InputError(fmt::format("{} is {}", field, value), fmt::format("allowed: {} to {} {}", low, high, unit));
}

}  // namespace

void RigPlanOptions::validate() const {
    if (lamps < fewest_lamps || lamps > most_lamps)
        throw InputError(fmt::format("lamps is {}", lamps), fmt::format("allowed: {} to {}", fewest_lamps, most_lamps));
    require_between("distance_mm", distance_mm, nearest_mm, farthest_mm, "mm");
    require_between("min_elevation_deg", min_elevation_deg, 0, 89, "degrees above the object's plane");
    require_between("max_elevation_deg", max_elevation_deg, 1, 90, "degrees above the object's plane");
    if (!(max_elevation_deg > min_elevation_deg))
        throw InputError(
            fmt::format("max_elevation_deg is {} and min_elevation_deg {}", max_elevation_deg, min_elevation_deg),
            "allowed: a greatest elevation above the least");
    if (min_separation_deg) require_between("min_separation_deg", *min_separation_deg, 0, 120, "degrees");
}

RigPlan plan_rig(const RigPlanOptions& options, const WorkContext& work) {
    options.validate();
    RigPlan plan;
    plan.shadows = options.shadows;
    if (plan.shadows == PlanShadows::automatic)
        plan.shadows = options.lamps == fewest_lamps ? PlanShadows::ignored : PlanShadows::respected;
    const Zone zone = zone_of(options);
    Candidate best = best_plan(options, zone, plan.shadows, work);
    sort_for_reading(best.places);
    for (const Place& place : best.places) plan.positions_mm.push_back(options.distance_mm * place.direction());
    plan.predicted_error_deg = best.error_deg;
    plan.geometry = light_geometry(lights_at(best.places));
    const Places naive = ring(options.lamps, zone.clamp(naive_elevation_deg));
    plan.ring_error_deg = Criterion(naive, plan.shadows).value();
    plan.ring_geometry = light_geometry(lights_at(naive));
    return plan;
}

}  // namespace darkbox
