#include "sim/optics.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

namespace darkbox::sim {
namespace {

/// Weights of neighbouring pixels, from `first` on, that make one pixel of the new row or column.
struct Kernel {
    int first = 0;
    std::vector<float> weights;
};

enum class Along { rows, columns };

RgbImage filtered(const RgbImage& image, const Kernel& kernel, Along along) {
    RgbImage result(image.width, image.height);
    for (int v = 0; v < image.height; ++v)
        for (int u = 0; u < image.width; ++u) {
            float* sum = result.pixel(u, v);
            for (std::size_t i = 0; i < kernel.weights.size(); ++i) {
                const int offset = kernel.first + static_cast<int>(i);
                const float* p = along == Along::rows ? image.pixel(std::clamp(u + offset, 0, image.width - 1), v)
                                                      : image.pixel(u, std::clamp(v + offset, 0, image.height - 1));
                for (int c = 0; c < 3; ++c) sum[c] += kernel.weights[i] * p[c];
            }
            for (int c = 0; c < 3; ++c) sum[c] = std::max(sum[c], 0.0F);
        }
    return result;
}

/// Keys' cubic of a = -1/2.
double cubic(double x) {
    x = std::abs(x);
    if (x < 1) return (1.5 * x - 2.5) * x * x + 1;
    return x < 2 ? ((-0.5 * x + 2.5) * x - 4) * x + 2 : 0;
}

}  // namespace

RgbImage shifted(const RgbImage& image, double right_px) {
    Kernel kernel;
    kernel.first = static_cast<int>(std::floor(-right_px)) - 1;
    for (int i = 0; i < 4; ++i) kernel.weights.push_back(static_cast<float>(cubic(kernel.first + i + right_px)));
    return filtered(image, kernel, Along::rows);
}

RgbImage blurred(const RgbImage& image, double sigma_px) {
    Kernel kernel;
    const int reach = static_cast<int>(std::ceil(4 * sigma_px));
    kernel.first = -reach;
    for (int i = -reach; i <= reach; ++i)
        kernel.weights.push_back(static_cast<float>(std::exp(-0.5 * i * i / (sigma_px * sigma_px))));
    const float sum = std::accumulate(kernel.weights.begin(), kernel.weights.end(), 0.0F);
    for (float& weight : kernel.weights) weight /= sum;
    return filtered(filtered(image, kernel, Along::rows), kernel, Along::columns);
}

void copy_disc(const RgbImage& source, const BallCircle& disc, RgbImage& target) {
    for (int v = 0; v < target.height; ++v)
        for (int u = 0; u < target.width; ++u)
            if (std::hypot(u - disc.centre.u, v - disc.centre.v) <= disc.radius + 1)
                std::copy_n(source.pixel(u, v), 3, target.pixel(u, v));
}

}  // namespace darkbox::sim
