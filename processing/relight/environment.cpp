#include "processing/relight/environment.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "processing/relight/coefficient.h"

namespace darkbox {
namespace {

constexpr int patch_rows = 32;
constexpr int patch_columns = 64;
constexpr int most_nodes = 65;  ///< of the grid over normals, per side
constexpr int fewest_nodes = 9;
constexpr std::size_t largest_table = std::size_t{1} << 29;  ///< bytes

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

/// Node (row, column) of the square [-1, 1]^2 that the hemisphere z >= 0 is folded onto (octahedral map, turned by 45
/// degrees): even cells, no seam.
cv::Vec3d normal_of_node(int row, int column, int nodes) {
    const double right = 2.0 * column / (nodes - 1) - 1, down = 2.0 * row / (nodes - 1) - 1;
    const double x = 0.5 * (right + down), y = 0.5 * (right - down);
    return cv::normalize(cv::Vec3d(x, y, std::max(0.0, 1 - std::abs(x) - std::abs(y))));
}

/// What a normal receives: weights of the levels, and what does not go through S.
struct Weights {
    std::vector<cv::Vec3d> levels;
    cv::Vec3d mirrored{0, 0, 0};
};

Weights fold_normal(const std::vector<DistantLight>& lights, const cv::Vec3d& normal, int levels,
                    const RelightOptions& options) {
    Weights sums{std::vector<cv::Vec3d>(static_cast<std::size_t>(levels), cv::Vec3d(0, 0, 0))};
    const double diffuse = options.model == ReflectanceModel::phong_split ? options.phong_diffuse : 1;
    const bool scaled = options.out_of_range == OutOfRange::scale;
    for (const DistantLight& light : lights) {
        const cv::Vec3d intensity(light.intensity);
        const auto [r, mirrored] = coefficients(normal, light.direction, options);
        sums.mirrored += intensity * mirrored;
        if (!(r > 0)) continue;
        const double position = std::min(r, 1.0) * (levels - 1);
        const int below = std::min(static_cast<int>(position), levels - 2);
        const double fraction = position - below, factor = diffuse * (scaled ? std::max(r, 1.0) : 1.0);
        sums.levels[below] += intensity * (factor * (1 - fraction));
        sums.levels[below + 1] += intensity * (factor * fraction);
    }
    return sums;
}

FoldedEnvironment::Colour table_entry(const cv::Vec3d& c) {
    return {static_cast<float>(c[0]), static_cast<float>(c[1]), static_cast<float>(c[2]), 0.0F};
}

/// Of texel k, counted from 0.
cv::Vec3d shaded(const ShadingMaps& maps, int k, const std::vector<cv::Vec3d>& weights) {
    cv::Vec3d sum(0, 0, 0);
    for (std::size_t level = 0; level < weights.size(); ++level)
        sum += weights[level].mul(cv::Vec3d(maps.radiance(k, static_cast<int>(level))));
    return sum;
}

int nodes_for(int texels) {
    const double affordable = static_cast<double>(largest_table) / sizeof(FoldedEnvironment::Colour) / (texels + 1);
    return std::clamp(static_cast<int>(std::sqrt(affordable)), fewest_nodes, most_nodes);
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
    : nodes_(nodes_for(maps.texels)), texels_(maps.texels) {
    const std::size_t nodes = static_cast<std::size_t>(nodes_) * nodes_, width = static_cast<std::size_t>(texels_) + 1;
    shading_.resize(nodes * width);
    if (options.model == ReflectanceModel::phong_split) mirrored_.resize(nodes);
    tbb::parallel_for(0, nodes_, [&](int row) {
        for (int column = 0; column < nodes_; ++column) {
            const std::size_t node = static_cast<std::size_t>(row) * nodes_ + column;
            const Weights weights = fold_normal(lights, normal_of_node(row, column, nodes_), maps.levels, options);
            for (int k = 0; k < texels_; ++k)
                shading_[node * width + k + 1] = table_entry(shaded(maps, k, weights.levels));
            if (!mirrored_.empty()) mirrored_[node] = table_entry(weights.mirrored.mul(options.specular_colour));
        }
    });
}

}  // namespace darkbox
