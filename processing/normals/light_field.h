#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <vector>

#include "processing/maps/lights.h"
#include "processing/maps/view.h"
#include "processing/normals/light_set.h"

namespace darkbox {

/// Light as it arrives at one pixel.
struct Arrival {
    Eigen::Vector3f direction{0, 0, 1};  ///< unit, to the light
    float falloff = 1;                   ///< irradiance there against the light's intensity
};

/// The used lights at every pixel of the picture. Refers to the lights it was made from. Thread-safe once made.
class LightField {
public:
    /// Throws InputError when a used light is near and the view is not known, and when the height map has not the
    /// picture's size.
    LightField(const Lights& lights, const LightSet& set, SceneGeometry geometry, cv::Size picture);

    /// All used lights are distant: the same at every pixel.
    bool uniform() const { return uniform_; }
    /// The directions are those at the surface: it is known, or all used lights are distant.
    bool known() const { return uniform_ || !geometry_.height_mm.empty(); }
    std::size_t size() const { return set_.lights.size(); }
    const LightSet& set() const { return set_; }
    /// The calibration's record of the k-th used light.
    const Light& light(std::size_t k) const { return lights_[set_.lights[k].image]; }

    /// `row` and `column` of the whole picture. One arrival for each used light, in the set's order.
    void arrivals(int row, int column, std::vector<Arrival>& arrivals) const;
    /// Unit direction from the surface to the camera there.
    Eigen::Vector3f to_camera(int row, int column) const;

private:
    const Lights& lights_;
    const LightSet& set_;
    SceneGeometry geometry_;
    bool uniform_ = true;
};

}  // namespace darkbox
