#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "processing/calibration/calibration.h"

namespace darkbox::test {

/// Mirror balls beside a diffuse sphere before a dim wall, seen orthographically. Written without the code under test:
/// each sub-pixel's view ray is mirrored and looked up in an environment of a dim room and one round lamp.
struct BallScene {
    cv::Size size{360, 240};
    Ball ball{250.3, 130.6, 60.2, 1.0};
    std::vector<Ball> more_balls;
    double wall = 0.06;  ///< radiance lit from the front
    double room = 1.0;   ///< brightness of what the balls mirror beside the lamp
    int checks = 0;      ///< of the sphere's texture, across it; 0: plain
    int rays_per_pixel_side = 4;
    double lamp_radius_deg = 2.0;
    double lamp_radiance = 0.9;
    double noise = 0.0;  ///< standard deviation, full scale = 1
    std::uint64_t seed = 1;
};

std::vector<Eigen::Vector3d> dome_of_lights(int n);
std::vector<std::string> frame_names(std::size_t n);

/// The scene under one lamp; radiance above 1 is clipped.
cv::Mat3f photograph(const BallScene& scene, const Eigen::Vector3d& light);
std::vector<cv::Mat3f> photographs(const BallScene& scene, const std::vector<Eigen::Vector3d>& lights);

/// A stream of normally distributed numbers that is the same everywhere: splitmix64 and Box-Muller.
class NormalNumbers {
public:
    explicit NormalNumbers(std::uint64_t seed) : state_(seed) {}
    double next();

private:
    double uniform();
    std::uint64_t state_;
};

}  // namespace darkbox::test
