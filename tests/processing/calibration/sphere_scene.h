#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

namespace darkbox::test {

/// Polished balls and a matt one before a dim wall, under one round lamp at a time. Millimetres, viewer frame, the
/// optical axis through the picture's centre. Written without the code under test: every sub-pixel's view ray is
/// followed to what it meets, and from a polished ball on to the lamp, the matt ball, the wall or a dim room.
struct SphereScene {
    struct Sphere {
        Eigen::Vector3d centre{0, 0, 0};
        double radius = 18;
    };
    cv::Size size{400, 200};
    double mm_per_pixel = 0.3;
    double camera_distance = std::numeric_limits<double>::infinity();  ///< infinite: orthographic
    std::vector<Sphere> balls;
    Sphere object{{0, 0, 0}, 12};
    bool near = false;     ///< lamps are points in mm; else directions
    double blur_px = 0.6;  ///< of the lens: standard deviation
    int rays_per_pixel_side = 4;
    bool wall = true;           ///< stands behind the balls; without it they mirror the room all around
    std::uint64_t room = 1;     ///< which dim room the balls mirror
    double lamp_radius = 0.05;  ///< of the glowing disc: mm for near lamps, else radians
    double lamp_radiance = 0.9;
};

/// A sensor's noise. Standard deviation of a sample: shot and read noise in electrons.
struct SensorNoise {
    double full_well_e = 20000;
    double read_e = 5;
    int bits = 12;
    std::uint64_t seed = 1;
};

/// Renders a scene under many lamps: where the view rays end is worked out once.
class SphereRenderer {
public:
    explicit SphereRenderer(SphereScene scene);
    /// Radiance without noise, not clipped. `lamp` is a place in mm or a direction.
    cv::Mat1f render(const Eigen::Vector3d& lamp) const;

private:
    struct Ray {
        enum class Meets { object, wall, room } meets = Meets::room;
        Eigen::Vector3d point{0, 0, 0};
        Eigen::Vector3d normal{0, 0, 1};
        bool mirrored = false;  ///< by a ball, from which it went on:
        Eigen::Vector3d from{0, 0, 0};
        Eigen::Vector3d along{0, 0, 1};
    };
    struct Wave {
        Eigen::Vector3d along;
        double phase;
    };
    Ray follow(double u, double v) const;
    Ray meeting(const Eigen::Vector3d& from, const Eigen::Vector3d& along) const;
    double radiance(const Ray& ray, const Eigen::Vector3d& lamp) const;
    double matt_radiance(const Ray& ray, const Eigen::Vector3d& lamp) const;
    double room(const Eigen::Vector3d& direction) const;

    SphereScene scene_;
    std::vector<Wave> room_;  ///< its brightness: waves over the sphere of directions
    std::vector<Ray> rays_;   ///< sub-pixels of pixels, row by row
};

/// A photograph of this radiance: noise, clipping at 1, quantisation; three channels with noise of their own.
cv::Mat3f photographed(const cv::Mat1f& radiance, const SensorNoise& noise);

}  // namespace darkbox::test
