#include "processing/texels/neighbourhood.h"

#include <tbb/parallel_for.h>

#include <algorithm>

namespace darkbox {
namespace {

void write_neighbourhood(const AlbedoMap& albedo, cv::Point centre, int window, float* out) {
    const int reach = window / 2;
    const cv::Rect image({0, 0}, albedo.albedo.size());
    for (int y = centre.y - reach; y <= centre.y + reach; ++y)
        for (int x = centre.x - reach; x <= centre.x + reach; ++x) {
            const cv::Point neighbour(x, y);
            const bool inside = image.contains(neighbour) && albedo.valid(neighbour) != 0;
            const cv::Vec3f& value = albedo.albedo(inside ? neighbour : centre);
            out = std::copy(value.val, value.val + 3, out);
        }
}

}  // namespace

cv::Mat1f neighbourhood_vectors(const AlbedoMap& albedo, const std::vector<cv::Point>& pixels, int window) {
    cv::Mat1f vectors(static_cast<int>(pixels.size()), window * window * 3);
    tbb::parallel_for(0, vectors.rows, [&](int i) { write_neighbourhood(albedo, pixels[i], window, vectors[i]); });
    return vectors;
}

}  // namespace darkbox
