#include "processing/normals/slopes.h"

#include <algorithm>

namespace darkbox {
namespace {

constexpr float steepest = 0.05F;  // least cosine: 87 degrees; beyond it the slope is noise

Slopes flat(int width, int height) {
    Slopes slopes{{width, height}, {}, {}, {}};
    for (auto* values : {&slopes.right, &slopes.down, &slopes.confidence}) values->assign(slopes.grid.size(), 0.0F);
    return slopes;
}

}  // namespace

Slopes slopes_of(const IntegrationInput& input, const cv::Rect& box) {
    Slopes slopes = flat(box.width, box.height);
    const double inverse_focal =
        input.view && input.view->perspective() ? input.view->mm_per_pixel / input.view->distance_mm : 0.0;
    const cv::Point2d principal = input.view ? input.view->principal : cv::Point2d();
    for (int y = 0; y < box.height; ++y)
        for (int x = 0; x < box.width; ++x) {
            const cv::Point pixel(box.x + x, box.y + y);
            if (!input.normals.valid(pixel)) continue;
            const cv::Vec3f& n = input.normals.normal(pixel);
            const auto ray_x = static_cast<float>((pixel.x - principal.x) * inverse_focal);
            const auto ray_y = static_cast<float>((principal.y - pixel.y) * inverse_focal);
            const float towards = std::max(n[2] - n[0] * ray_x - n[1] * ray_y, steepest);
            const std::size_t i = slopes.grid.at(x, y);
            slopes.right[i] = -n[0] / towards;
            slopes.down[i] = n[1] / towards;
            slopes.confidence[i] = input.confidence.empty() ? 1.0F : input.confidence(pixel);
        }
    return slopes;
}

Slopes halved(const Slopes& fine) {
    Slopes half = flat((fine.grid.width + 1) / 2, (fine.grid.height + 1) / 2);
    for (int y = 0; y < fine.grid.height; ++y)
        for (int x = 0; x < fine.grid.width; ++x) {
            const std::size_t from = fine.grid.at(x, y), to = half.grid.at(x / 2, y / 2);
            const float confidence = fine.confidence[from];
            half.right[to] += confidence * fine.right[from];
            half.down[to] += confidence * fine.down[from];
            half.confidence[to] += confidence;
        }
    for (std::size_t i = half.grid.begin(); i < half.grid.end(); ++i) {
        if (!half.valid(i)) continue;
        half.right[i] /= half.confidence[i];
        half.down[i] /= half.confidence[i];
        half.confidence[i] /= 4;
    }
    return half;
}

}  // namespace darkbox
