#pragma once

#include <cmath>
#include <numbers>
#include <opencv2/core.hpp>
#include <random>

namespace darkbox::test {

/// A bright half plane whose edge is a Gaussian's integral of this width, 100x100 pixels.
inline cv::Mat1f blurred_edge(double sigma, double noise_sigma = 0) {
    std::mt19937 random(1);
    std::normal_distribution<float> noise(0, static_cast<float>(noise_sigma));
    cv::Mat1f picture(100, 100);
    for (int v = 0; v < 100; ++v)
        for (int u = 0; u < 100; ++u) {
            const double across = (u - 50.3) * std::cos(0.3) + (v - 49.7) * std::sin(0.3);
            picture(v, u) = static_cast<float>(0.1 + 0.25 * (1 + std::erf(across / sigma / std::numbers::sqrt2)));
            if (noise_sigma > 0) picture(v, u) += noise(random);
        }
    return picture;
}

}  // namespace darkbox::test
