#pragma once

#include <cstddef>
#include <vector>

#include "sim/geometry.h"

namespace darkbox::sim {

/// Linear radiance (or any three floats) per pixel, interleaved, rows from the top.
struct RgbImage {
    RgbImage() = default;
    RgbImage(int w, int h) : width(w), height(h), samples(3 * static_cast<std::size_t>(w) * h, 0.0F) {}

    float* pixel(int u, int v) { return &samples[3 * (static_cast<std::size_t>(v) * width + u)]; }
    const float* pixel(int u, int v) const { return &samples[3 * (static_cast<std::size_t>(v) * width + u)]; }
    void set(int u, int v, const Rgb& c) {
        float* p = pixel(u, v);
        p[0] = static_cast<float>(c.r);
        p[1] = static_cast<float>(c.g);
        p[2] = static_cast<float>(c.b);
    }

    int width = 0;
    int height = 0;
    std::vector<float> samples;
};

}  // namespace darkbox::sim
