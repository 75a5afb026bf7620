#include "processing/normals/light_field.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "acquisition/frame/error.h"

namespace darkbox {

LightField::LightField(const Lights& lights, const LightSet& set, SceneGeometry geometry, cv::Size picture)
    : lights_(lights), set_(set), geometry_(std::move(geometry)) {
    for (const SolverLight& used : set.lights)
        if (const Light& light = lights[used.image]; light.near) {
            uniform_ = false;
            if (!geometry_.view)
                throw InputError(
                    fmt::format("the light of {} is near, but where the pixels lie is not known", light.file),
                    "give the view: millimetres per pixel at the object");
        }
    if (!geometry_.height_mm.empty() && geometry_.height_mm.size() != picture)
        throw InputError(fmt::format("the height map is {}x{} pixels, the photographs {}x{}", geometry_.height_mm.cols,
                                     geometry_.height_mm.rows, picture.width, picture.height),
                         "give a height for each pixel of the photographs");
}

void LightField::arrivals(int row, int column, std::vector<Arrival>& arrivals) const {
    arrivals.resize(size());
    if (uniform_) {
        for (std::size_t k = 0; k < size(); ++k) arrivals[k] = {set_.lights[k].direction, 1.0F};
        return;
    }
    const Eigen::Vector3d point = geometry_.point_at(row, column);
    for (std::size_t k = 0; k < size(); ++k) {
        const Incidence light_there = incidence(light(k), point);
        arrivals[k] = {light_there.direction.cast<float>(), static_cast<float>(light_there.falloff)};
    }
}

Eigen::Vector3f LightField::to_camera(int row, int column) const {
    if (!geometry_.view || !geometry_.view->perspective()) return {0, 0, 1};
    return geometry_.view->to_camera(geometry_.point_at(row, column)).cast<float>();
}

}  // namespace darkbox
