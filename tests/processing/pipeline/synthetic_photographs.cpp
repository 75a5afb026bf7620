#include "tests/processing/pipeline/synthetic_photographs.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "processing/formats/png.h"

namespace darkbox::test {
namespace {

constexpr double centre_u = 47.5, centre_v = 39.5, radius = 30;

cv::Vec3d normal_at(int u, int v) {
    const double x = (u - centre_u) / radius, y = -(v - centre_v) / radius, rest = 1 - x * x - y * y;
    return rest > 0 ? cv::Vec3d(x, y, std::sqrt(rest)) : cv::Vec3d(0, 0, 0);
}

}  // namespace

Lights lamp_ring() {
    Lights lights(7);
    for (int i = 0; i < 6; ++i) {
        const double angle = i * std::numbers::pi / 3;
        lights[static_cast<std::size_t>(i)].direction =
            Eigen::Vector3d(0.5 * std::cos(angle), 0.5 * std::sin(angle), 1).normalized();
    }
    return lights;
}

cv::Mat3f lambert_ball(const Light& light) {
    cv::Mat3f image(80, 96, cv::Vec3f(0, 0, 0));
    const cv::Vec3d l(light.direction.x(), light.direction.y(), light.direction.z());
    for (int v = 0; v < image.rows; ++v)
        for (int u = 0; u < image.cols; ++u) {
            const double shade = std::max(0.0, normal_at(u, v).dot(l));
            const cv::Vec3d albedo = u < 48 ? cv::Vec3d(0.8, 0.4, 0.2) : cv::Vec3d(0.2, 0.5, 0.7);
            image(v, u) = albedo * shade;
        }
    return image;
}

cv::Mat1b lambert_ball_mask() {
    cv::Mat1b mask(80, 96, uchar{0});
    for (int v = 0; v < mask.rows; ++v)
        for (int u = 0; u < mask.cols; ++u)
            if (normal_at(u, v)[2] > 0) mask(v, u) = 255;
    return mask;
}

void write_photographs(const std::filesystem::path& folder, const Lights& lights) {
    for (std::size_t i = 0; i < lights.size(); ++i) {
        cv::Mat words;
        lambert_ball(lights[i]).convertTo(words, CV_16U, 65535);
        write_png(folder / fmt::format("frame{}.png", i + 1), words);
    }
}

}  // namespace darkbox::test
