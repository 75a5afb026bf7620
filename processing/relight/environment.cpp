#include "processing/relight/environment.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "processing/relight/coefficient.h"
#include "processing/relight/levels.h"

namespace darkbox {
namespace {

constexpr int patch_rows = 32;
constexpr int patch_columns = 64;
constexpr int cells = 64;  ///< of the grid over normals, per side
constexpr int nodes = cells + 1;

/// Directions and solid angles of an equirectangular image, as Environment describes it.
class ProbeGeometry {
public:
    ProbeGeometry(cv::Size size, double yaw)
        : polar_step_(std::numbers::pi / size.height), turn_step_(2 * std::numbers::pi / size.width), yaw_(yaw) {}

    cv::Vec3d direction(int row, int column) const {
        const double polar = (row + 0.5) * polar_step_;
        const double turn = (column + 0.5) * turn_step_ - std::numbers::pi - yaw_;
        return {std::sin(polar) * std::sin(turn), std::cos(polar), -std::sin(polar) * std::cos(turn)};
    }

    double solid_angle(int row) const {
        return turn_step_ * (std::cos(row * polar_step_) - std::cos((row + 1) * polar_step_));
    }

private:
    double polar_step_;
    double turn_step_;
    double yaw_;
};

DistantLight light_of_patch(const cv::Mat3f& radiance, const ProbeGeometry& geometry, const cv::Rect& patch) {
    cv::Vec3d direction(0, 0, 0);
    cv::Vec3d intensity(0, 0, 0);
    for (int y = patch.y; y < patch.br().y; ++y)
        for (int x = patch.x; x < patch.br().x; ++x) {
            const cv::Vec3d light = cv::Vec3d(radiance(y, x)) * (geometry.solid_angle(y) / std::numbers::pi);
            intensity += light;
            direction += geometry.direction(y, x) * (light[0] + light[1] + light[2]);
        }
    const double length = cv::norm(direction);
    return {length > 0 ? direction * (1 / length) : direction, intensity};
}

/// One axis of the patches: border i of `parts` over `length` pixels.
int border(int i, int parts, int length) { return static_cast<int>(static_cast<long>(i) * length / parts); }

/// The hemisphere z >= 0 folded onto the square [-1, 1]^2 (octahedral map, turned by 45 degrees): even cells, no seam.
cv::Vec2f square_from_normal(const cv::Vec3f& normal) {
    const float z = std::max(0.0F, normal[2]);
    const float scale = 1.0F / (std::abs(normal[0]) + std::abs(normal[1]) + z);
    return {(normal[0] + normal[1]) * scale, (normal[0] - normal[1]) * scale};
}

cv::Vec3f normal_from_square(const cv::Vec2f& square) {
    const float x = 0.5F * (square[0] + square[1]);
    const float y = 0.5F * (square[0] - square[1]);
    return cv::normalize(cv::Vec3f(x, y, std::max(0.0F, 1 - std::abs(x) - std::abs(y))));
}

float coordinate_of_node(int i) { return 2.0F * static_cast<float>(i) / cells - 1.0F; }

/// The weight of each level for one normal.
template <class Model>
std::vector<cv::Vec3d> fold_normal(const std::vector<DistantLight>& lights, const cv::Vec3f& normal,
                                   const Model& coefficient, int levels) {
    std::vector<cv::Vec3d> sums(levels, cv::Vec3d(0, 0, 0));
    for (const DistantLight& light : lights) {
        const float r = coefficient(normal, light.direction);
        if (!(r > 0)) continue;
        const LevelPosition position(r, levels);
        sums[position.below] += cv::Vec3d(light.intensity) * (1.0 - position.fraction);
        sums[position.below + 1] += cv::Vec3d(light.intensity) * static_cast<double>(position.fraction);
    }
    return sums;
}

}  // namespace

std::vector<DistantLight> probe_lights(const Environment& environment, double yaw) {
    const cv::Size size = environment.radiance.size();
    const ProbeGeometry geometry(size, yaw);
    const int rows = std::min(patch_rows, size.height);
    const int columns = std::min(patch_columns, size.width);
    std::vector<DistantLight> lights(static_cast<std::size_t>(rows) * columns);
    tbb::parallel_for(0, rows, [&](int row) {
        for (int column = 0; column < columns; ++column) {
            const cv::Point begin(border(column, columns, size.width), border(row, rows, size.height));
            const cv::Point end(border(column + 1, columns, size.width), border(row + 1, rows, size.height));
            lights[static_cast<std::size_t>(row) * columns + column] =
                light_of_patch(environment.radiance, geometry, cv::Rect(begin, end));
        }
    });
    std::erase_if(lights, [](const DistantLight& light) { return cv::norm(light.direction) == 0; });
    return lights;
}

FoldedEnvironment::FoldedEnvironment(const std::vector<DistantLight>& lights, const ShadingMaps& maps,
                                     const RelightOptions& options)
    : levels_(maps.levels), weights_(static_cast<std::size_t>(nodes) * nodes * levels_) {
    const auto colour = [](const auto& c) {
        return Colour{static_cast<float>(c[0]), static_cast<float>(c[1]), static_cast<float>(c[2]), 0.0F};
    };
    with_model(options, [&](const auto& coefficient) {
        tbb::parallel_for(0, nodes, [&](int row) {
            for (int column = 0; column < nodes; ++column) {
                const cv::Vec2f square(coordinate_of_node(column), coordinate_of_node(row));
                const auto weights = fold_normal(lights, normal_from_square(square), coefficient, levels_);
                const std::size_t first = (static_cast<std::size_t>(row) * nodes + column) * levels_;
                std::transform(weights.begin(), weights.end(), weights_.begin() + first, colour);
            }
        });
    });
    shading_.reserve(static_cast<std::size_t>(maps.texels) * levels_);
    for (const cv::Vec3f& value : maps.radiance) shading_.push_back(colour(value));
}

const FoldedEnvironment::Colour* FoldedEnvironment::node(int row, int column) const {
    return &weights_[(static_cast<std::size_t>(row) * nodes + column) * levels_];
}

cv::Vec3f FoldedEnvironment::radiance(const cv::Vec3f& normal, int label) const {
    const cv::Vec2f square = square_from_normal(normal);
    const LevelPosition column(0.5F * (square[0] + 1), nodes);
    const LevelPosition row(0.5F * (square[1] + 1), nodes);
    const Colour* top = node(row.below, column.below);
    const Colour* bottom = node(row.below + 1, column.below);
    const Colour* shading = &shading_[static_cast<std::size_t>(label - 1) * levels_];
    Colour at_top{};
    Colour at_top_right{};
    Colour at_bottom{};
    Colour at_bottom_right{};
    for (int level = 0; level < levels_; ++level) {
        at_top += shading[level] * top[level];
        at_top_right += shading[level] * top[level + levels_];
        at_bottom += shading[level] * bottom[level];
        at_bottom_right += shading[level] * bottom[level + levels_];
    }
    const Colour upper = at_top + column.fraction * (at_top_right - at_top);
    const Colour lower = at_bottom + column.fraction * (at_bottom_right - at_bottom);
    const Colour sum = upper + row.fraction * (lower - upper);
    return {sum[0], sum[1], sum[2]};
}

}  // namespace darkbox
