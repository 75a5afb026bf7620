#include "processing/relight/near_rays.h"

#include <algorithm>
#include <cmath>

// Highway compiles this file once for each kind of processor.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "processing/relight/near_rays.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace darkbox {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using Floats = hn::CappedTag<float, block_pixels>;

void to_lamp(const NearLamp& lamp, const PointBlock& points, RayBlock& rays) {
    const Floats d;
    // A lamp in the surface itself lights nothing that its pixel sees; it must not divide by zero.
    const auto least = hn::Set(d, 1e-6F);
    const auto reference = hn::Set(d, lamp.squared_reference);
    for (std::size_t i = 0; i < block_pixels; i += hn::Lanes(d)) {
        const auto x = hn::Sub(hn::Set(d, lamp.position[0]), hn::Load(d, points.x + i));
        const auto y = hn::Sub(hn::Set(d, lamp.position[1]), hn::Load(d, points.y + i));
        const auto z = hn::Sub(hn::Set(d, lamp.position[2]), hn::Load(d, points.z + i));
        const auto squared = hn::Max(hn::MulAdd(z, z, hn::MulAdd(x, x, hn::Mul(y, y))), least);
        const auto inverse = hn::Div(hn::Set(d, 1.0F), hn::Sqrt(squared));
        hn::Store(hn::Mul(x, inverse), d, rays.direction[0] + i);
        hn::Store(hn::Mul(y, inverse), d, rays.direction[1] + i);
        hn::Store(hn::Mul(z, inverse), d, rays.direction[2] + i);
        hn::Store(hn::Div(reference, squared), d, rays.falloff + i);
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace darkbox
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace darkbox {

HWY_EXPORT(to_lamp);

NearLamp::NearLamp(const LampPosition& lamp)
    : position(cv::Vec3d(lamp.position_mm[0], lamp.position_mm[1], lamp.position_mm[2])),
      squared_reference(static_cast<float>((lamp.position_mm - lamp.object_mm).squaredNorm())) {}

void find_points(const SceneGeometry& geometry, int row, int first_column, PointBlock& points) {
    const ViewGeometry& view = *geometry.view;
    std::fill_n(points.z, block_pixels, 0.0F);
    if (!geometry.height_mm.empty()) {
        const int count = std::min(block_pixels, geometry.height_mm.cols - first_column);
        const float* height = geometry.height_mm[row] + first_column;
        for (int i = 0; i < count; ++i) points.z[i] = std::isfinite(height[i]) ? height[i] : 0.0F;
    }
    const auto per_distance = static_cast<float>(view.perspective() ? 1 / view.distance_mm : 0.0);
    const auto step = static_cast<float>(view.mm_per_pixel);
    const auto left = static_cast<float>((first_column - view.principal.x) * view.mm_per_pixel);
    const auto up = static_cast<float>((view.principal.y - row) * view.mm_per_pixel);
    for (int i = 0; i < block_pixels; ++i) {
        const float spread = 1 - points.z[i] * per_distance;
        points.x[i] = (left + step * static_cast<float>(i)) * spread;
        points.y[i] = up * spread;
    }
}

void find_rays(const NearLamp& lamp, const PointBlock& points, RayBlock& rays) {
    HWY_DYNAMIC_DISPATCH(to_lamp)(lamp, points, rays);
}

}  // namespace darkbox
#endif
