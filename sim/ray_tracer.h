#pragma once

#include <memory>
#include <optional>

#include "sim/geometry.h"
#include "sim/scene.h"

namespace darkbox::sim {

/// Where a ray meets the scene's solid things.
struct RayHit {
    const MirrorBall* ball = nullptr;    ///< none for the object
    const Material* material = nullptr;  ///< none for a ball
    double distance_mm = 0.0;
    Vec3 geometric_normal;  ///< unit, towards where the ray came from
    Vec3 normal;            ///< unit, of the smooth surface, on the same side
    SurfacePoint point;
};

/// The scene's surfaces and balls in Embree's tree. Robust traversal and a tree built by one thread: the same hits on
/// any number of threads. Refers to the scene it was made from. Const members are thread-safe.
class RayTracer {
public:
    explicit RayTracer(const Scene& scene);
    ~RayTracer();
    RayTracer(const RayTracer&) = delete;
    RayTracer& operator=(const RayTracer&) = delete;

    std::optional<RayHit> first_hit(const Ray& ray) const;
    /// Whether anything lies on the ray before `distance_mm`.
    bool blocked(const Ray& ray, double distance_mm) const;

private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace darkbox::sim
