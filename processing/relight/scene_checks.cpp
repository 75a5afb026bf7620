#include "processing/relight/scene_checks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "acquisition/frame/error.h"
#include "processing/maps/require.h"

namespace darkbox {
namespace {

constexpr int most_levels = 65536;

bool is_finite(const cv::Vec3f& value) {
    return std::isfinite(value[0]) && std::isfinite(value[1]) && std::isfinite(value[2]);
}

void require_shading(const ShadingMaps& maps, int texels) {
    if (maps.texels != texels || maps.levels < 2 || maps.levels > most_levels ||
        maps.radiance.size() != cv::Size(maps.levels, maps.texels) ||
        maps.mean_albedo.size() != cv::Size(1, maps.texels))
        throw InputError(
            fmt::format("the shading maps are for {} texels and {} levels, but the index map has {} texels",
                        maps.texels, maps.levels, texels),
            "compute the shading maps again from these texels");
    if (!std::all_of(maps.radiance.begin(), maps.radiance.end(), is_finite) ||
        !std::all_of(maps.mean_albedo.begin(), maps.mean_albedo.end(), is_finite))
        throw InputError("the shading maps hold a value that is not a finite number", "compute them again");
}

void require_usable_normals(const NormalMap& normals) {
    for (int y = 0; y < normals.normal.rows; ++y)
        for (int x = 0; x < normals.normal.cols; ++x) {
            if (normals.valid(y, x) == 0) continue;
            const cv::Vec3f& n = normals.normal(y, x);
            if (!(std::abs(n.dot(n) - 1) < 0.01F))
                throw InputError(
                    fmt::format("the normal at pixel {}, {} is {}, {}, {}: not a unit vector", x, y, n[0], n[1], n[2]),
                    "normalise the normal map, or mark such pixels as not valid");
        }
}

}  // namespace

void require_range(const char* field, double value, double lowest, double highest) {
    if (!(value >= lowest && value <= highest))
        throw InputError(fmt::format("relight: {} is {}, allowed are {}...{}", field, value, lowest, highest),
                         fmt::format("set {} within that range", field));
}

void require_scene(const RelightScene& scene) {
    const cv::Size size = scene.index.label.size();
    if (size.empty()) throw InputError("the index map is empty", "compute the texels first");
    require_size("the normal map", scene.normals.normal.size(), size);
    require_size("the normal map's mask", scene.normals.valid.size(), size);
    require_size("the albedo map", scene.albedo.albedo.size(), size);
    require_size("the albedo map's mask", scene.albedo.valid.size(), size);
    if (!scene.geometry.height_mm.empty()) require_size("the height map", scene.geometry.height_mm.size(), size);
    require_labels(scene.index);
    require_shading(scene.shading, scene.index.texels);
    require_usable_normals(scene.normals);
}

void require_near_lamp(const Light& lamp, const SceneGeometry& geometry) {
    if (!geometry.view)
        throw InputError(
            fmt::format("the lamp {} stands near, but where the object's pixels lie is not known", lamp.file),
            "give the scene's view: millimetres per pixel at the object");
    const Eigen::Vector3d& position = lamp.near->position_mm;
    if (!position.allFinite() || !((position - lamp.near->object_mm).norm() > 0))
        throw InputError(fmt::format("the lamp {} stands at ({}, {}, {}) mm, where no lamp can stand", lamp.file,
                                     position[0], position[1], position[2]),
                         "give a place off the object, in millimetres of the viewer frame");
}

void require_probe(const Environment& environment) {
    if (environment.radiance.empty()) throw InputError("the environment map is empty", "give a light probe");
    for (const cv::Vec3f& value : environment.radiance)
        if (!is_finite(value) || value[0] < 0 || value[1] < 0 || value[2] < 0)
            throw InputError(
                fmt::format("the environment map holds a radiance of {}, {}, {}", value[0], value[1], value[2]),
                "give a probe whose values are finite and not negative");
}

}  // namespace darkbox
