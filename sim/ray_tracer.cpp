#include "sim/ray_tracer.h"

#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <variant>

#include "sim/embree.h"

namespace darkbox::sim {
namespace {

template <auto release>
struct Release {
    template <class T>
    void operator()(T* handle) const {
        release(handle);
    }
};
using DeviceHandle = std::unique_ptr<RTCDeviceTy, Release<rtcReleaseDevice>>;
using SceneHandle = std::unique_ptr<RTCSceneTy, Release<rtcReleaseScene>>;
using GeometryHandle = std::unique_ptr<RTCGeometryTy, Release<rtcReleaseGeometry>>;

void* new_buffer(RTCGeometry geometry, RTCBufferType type, RTCFormat format, std::size_t stride, std::size_t count) {
    void* buffer = rtcSetNewGeometryBuffer(geometry, type, 0, format, stride, count);
    if (buffer == nullptr) throw std::runtime_error("Embree cannot allocate a geometry buffer");
    return buffer;
}

GeometryHandle sphere_geometry(RTCDevice device, const Sphere& sphere) {
    GeometryHandle geometry(rtcNewGeometry(device, RTC_GEOMETRY_TYPE_SPHERE_POINT));
    auto* p = static_cast<float*>(
        new_buffer(geometry.get(), RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT4, 4 * sizeof(float), 1));
    p[0] = static_cast<float>(sphere.centre.x);
    p[1] = static_cast<float>(sphere.centre.y);
    p[2] = static_cast<float>(sphere.centre.z);
    p[3] = static_cast<float>(sphere.radius_mm);
    return geometry;
}

GeometryHandle mesh_geometry(RTCDevice device, const TriangleMesh& mesh) {
    GeometryHandle geometry(rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE));
    auto* p = static_cast<float*>(
        new_buffer(geometry.get(), RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT3, 3 * sizeof(float), mesh.vertices.size()));
    for (const Vertex& vertex : mesh.vertices) {
        *p++ = static_cast<float>(vertex.position.x);
        *p++ = static_cast<float>(vertex.position.y);
        *p++ = static_cast<float>(vertex.position.z);
    }
    auto* index = static_cast<unsigned*>(new_buffer(geometry.get(), RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT3,
                                                    3 * sizeof(unsigned), mesh.triangles.size()));
    for (const auto& triangle : mesh.triangles)
        for (const auto corner : triangle) *index++ = corner;
    return geometry;
}

RTCRay embree_ray(const Ray& ray, double far_mm) {
    RTCRay r{};
    r.org_x = static_cast<float>(ray.origin.x);
    r.org_y = static_cast<float>(ray.origin.y);
    r.org_z = static_cast<float>(ray.origin.z);
    r.dir_x = static_cast<float>(ray.direction.x);
    r.dir_y = static_cast<float>(ray.direction.y);
    r.dir_z = static_cast<float>(ray.direction.z);
    r.tfar = static_cast<float>(far_mm);
    r.mask = ~0U;
    return r;
}

Vec3 facing(const Vec3& normal, const Vec3& direction) { return dot(normal, direction) > 0.0 ? -normal : normal; }

/// Tiles around a sphere's equator, and from pole to pole; the poles lie along y.
constexpr int sphere_tiles_around = 24;
constexpr int sphere_tiles_up = 24;

/// Longitude and latitude in tiles. At the poles the derivative along the parallel is zero.
SurfacePoint point_on_sphere(const Sphere& sphere, const Vec3& position, const Vec3& outward) {
    constexpr double pi = std::numbers::pi;
    SurfacePoint point;
    point.position = position;
    const double from_axis = std::hypot(outward.x, outward.z);
    point.uv = {(std::atan2(outward.x, outward.z) / (2.0 * pi) + 0.5) * sphere_tiles_around,
                (std::atan2(outward.y, from_axis) / pi + 0.5) * sphere_tiles_up};
    point.period_u = sphere_tiles_around;
    if (from_axis > 0.0) {
        const Vec3 east{outward.z / from_axis, 0.0, -outward.x / from_axis};
        point.position_du = east * (2.0 * pi * sphere.radius_mm * from_axis / sphere_tiles_around);
        point.position_dv = cross(outward, east) * (pi * sphere.radius_mm / sphere_tiles_up);
    }
    return point;
}

/// The hit again in double precision: Embree's floats only tell that there is one.
RayHit on_sphere(const Sphere& sphere, const Ray& ray, double rough_distance) {
    const Vec3 to_centre = sphere.centre - ray.origin;
    const double middle = dot(to_centre, ray.direction);
    const Vec3 off_axis = to_centre - ray.direction * middle;
    const double half_chord = std::sqrt(std::max(0.0, sphere.radius_mm * sphere.radius_mm - dot(off_axis, off_axis)));
    RayHit hit;
    hit.distance_mm = rough_distance < middle ? middle - half_chord : middle + half_chord;
    const Vec3 position = ray.origin + ray.direction * hit.distance_mm;
    const Vec3 outward = unit(position - sphere.centre);
    hit.point = point_on_sphere(sphere, position, outward);
    hit.normal = facing(outward, ray.direction);
    hit.geometric_normal = hit.normal;
    return hit;
}

RayHit on_mesh(const TriangleMesh& mesh, const Ray& ray, const RTCRayHit& found) {
    const auto& corners = mesh.triangles[found.hit.primID];
    const Vertex& a = mesh.vertices[corners[0]];
    const Vertex& b = mesh.vertices[corners[1]];
    const Vertex& c = mesh.vertices[corners[2]];
    const double wb = found.hit.u;
    const double wc = found.hit.v;
    const double wa = 1.0 - wb - wc;
    const auto blend = [&](Vec3 Vertex::* field) { return a.*field * wa + b.*field * wb + c.*field * wc; };
    RayHit hit;
    hit.distance_mm = found.ray.tfar;
    hit.point.position = blend(&Vertex::position);
    hit.point.uv = {a.uv.u * wa + b.uv.u * wb + c.uv.u * wc, a.uv.v * wa + b.uv.v * wb + c.uv.v * wc};
    hit.point.position_du = blend(&Vertex::position_du);
    hit.point.position_dv = blend(&Vertex::position_dv);
    hit.point.period_u = mesh.period_u;
    hit.point.period_v = mesh.period_v;
    const Vec3 outward = unit(cross(b.position - a.position, c.position - a.position));
    const Vec3 smooth = mesh.exact_normal ? mesh.exact_normal(hit.point.position) : unit(blend(&Vertex::normal));
    hit.geometric_normal = facing(outward, ray.direction);
    hit.normal = dot(smooth, hit.geometric_normal) < 0.0 ? -smooth : smooth;
    return hit;
}

}  // namespace

struct RayTracer::State {
    const Scene& scene;
    DeviceHandle device;
    SceneHandle tree;
};

RayTracer::RayTracer(const Scene& scene) : state_(new State{scene, {}, {}}) {
    state_->device.reset(rtcNewDevice("threads=1"));
    if (!state_->device) throw std::runtime_error("Embree does not start");
    RTCDevice device = state_->device.get();
    state_->tree.reset(rtcNewScene(device));
    rtcSetSceneFlags(state_->tree.get(), RTC_SCENE_FLAG_ROBUST);
    const auto attach = [&](GeometryHandle geometry, std::size_t id) {
        rtcCommitGeometry(geometry.get());
        rtcAttachGeometryByID(state_->tree.get(), geometry.get(), static_cast<unsigned>(id));
    };
    for (std::size_t i = 0; i < scene.object.size(); ++i) {
        const auto& shape = scene.object[i].shape;
        if (const auto* sphere = std::get_if<Sphere>(&shape))
            attach(sphere_geometry(device, *sphere), i);
        else
            attach(mesh_geometry(device, std::get<TriangleMesh>(shape)), i);
    }
    for (std::size_t i = 0; i < scene.balls.size(); ++i)
        attach(sphere_geometry(device, scene.balls[i].sphere), scene.object.size() + i);
    rtcCommitScene(state_->tree.get());
}

RayTracer::~RayTracer() = default;

std::optional<RayHit> RayTracer::first_hit(const Ray& ray) const {
    RTCRayHit found{};
    found.ray = embree_ray(ray, std::numeric_limits<double>::infinity());
    found.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    embree_intersect(state_->tree.get(), &found);
    if (found.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
    const Scene& scene = state_->scene;
    if (found.hit.geomID >= scene.object.size()) {
        const MirrorBall& ball = scene.balls[found.hit.geomID - scene.object.size()];
        RayHit hit = on_sphere(ball.sphere, ray, found.ray.tfar);
        hit.ball = &ball;
        return hit;
    }
    const Surface& surface = scene.object[found.hit.geomID];
    const auto* sphere = std::get_if<Sphere>(&surface.shape);
    RayHit hit = sphere != nullptr ? on_sphere(*sphere, ray, found.ray.tfar)
                                   : on_mesh(std::get<TriangleMesh>(surface.shape), ray, found);
    hit.material = &surface.material;
    return hit;
}

bool RayTracer::blocked(const Ray& ray, double distance_mm) const {
    RTCRay shadow = embree_ray(ray, distance_mm);
    embree_occluded(state_->tree.get(), &shadow);
    return shadow.tfar < 0.0F;
}

}  // namespace darkbox::sim
