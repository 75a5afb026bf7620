#include "processing/calibration/first_lights.h"

#include <algorithm>

namespace darkbox {
namespace {

constexpr double near_fields = 10;
constexpr double guessed_distance_mm = 1000;  ///< where nothing at all is known of any lamp

std::optional<double> median(std::vector<double> values) {
    if (values.empty()) return std::nullopt;
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

std::optional<Eigen::Vector3d> nominal_of(const std::optional<NominalLamps>& nominal, std::size_t frame) {
    return nominal ? nominal->position_in_rig_mm[frame] : std::nullopt;
}

std::optional<double> usual_distance(const RaysToLamps& rays, const std::optional<NominalLamps>& nominal) {
    std::vector<double> distances;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        if (const auto place = nominal_of(nominal, i))
            distances.push_back(place->norm());
        else if (const auto met = meeting_point(rays[i]))
            distances.push_back((*met - rays[i].front().point_mm).norm());
    }
    return median(distances);
}

}  // namespace

RaysToLamps rays_to_lamps(const ViewGeometry& view, const std::vector<BallObservations>& balls, std::size_t frames) {
    RaysToLamps rays(frames);
    for (std::size_t frame = 0; frame < frames; ++frame)
        for (const BallObservations& ball : balls)
            if (const auto& h = ball.highlights[frame])
                if (const auto ray = reflect_at(view, ball.sphere, {h->u, h->v})) rays[frame].push_back(*ray);
    return rays;
}

LampModel choose_lamp_model(const RaysToLamps& rays, const std::optional<NominalLamps>& nominal,
                            const std::optional<double>& field_mm) {
    if (!field_mm) return LampModel::distant;
    if (nominal) {
        const auto distance = usual_distance(rays, nominal);
        return distance && *distance < near_fields * *field_mm ? LampModel::near : LampModel::distant;
    }
    std::size_t seen = 0, near = 0;
    for (const auto& frame : rays) {
        if (frame.size() < 2) continue;
        ++seen;
        const auto met = meeting_point(frame);
        if (met && (*met - frame.front().point_mm).norm() < near_fields * *field_mm) ++near;
    }
    return 2 * near > seen ? LampModel::near : LampModel::distant;
}

std::vector<Eigen::Vector3d> first_directions(const RaysToLamps& rays) {
    std::vector<Eigen::Vector3d> directions;
    for (const auto& frame : rays) {
        Eigen::Vector3d sum = Eigen::Vector3d::Zero();
        for (const Reflection& ray : frame) sum += ray.direction;
        directions.push_back(sum.norm() > 0 ? sum.normalized() : Eigen::Vector3d(0, 0, 1));
    }
    return directions;
}

FirstPositions first_positions(const RaysToLamps& rays, const std::optional<NominalLamps>& nominal) {
    const double usual = usual_distance(rays, nominal).value_or(guessed_distance_mm);
    FirstPositions first;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        const auto place = nominal_of(nominal, i);
        const auto met = meeting_point(rays[i]);
        const bool met_near = met && (*met - rays[i].front().point_mm).norm() < 3 * usual;
        first.distance_known.push_back(met_near || place);
        if (rays[i].empty()) {
            first.position_mm.emplace_back(0, 0, usual);
        } else if (met_near) {
            first.position_mm.push_back(*met);
        } else {
            const Reflection& ray = rays[i].front();
            const double reach = place ? (*place - ray.point_mm).norm() : usual;
            first.position_mm.push_back(ray.point_mm + reach * ray.direction);
        }
    }
    return first;
}

}  // namespace darkbox
