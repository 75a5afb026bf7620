#pragma once

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <numbers>
#include <random>
#include <vector>

#include "processing/normals/photometric_stereo.h"

namespace darkbox::test {

/// Whether two maps are the same, bit for bit, where a NaN equals itself.
inline bool same_bits(const cv::Mat& a, const cv::Mat& b) {
    return a.size() == b.size() && a.type() == b.type() && a.isContinuous() && b.isContinuous() &&
           std::memcmp(a.data, b.data, a.total() * a.elemSize()) == 0;
}

/// Radiance of a grey surface under light of irradiance 1, from normal, light and view.
using Reflect = std::function<double(const Eigen::Vector3d& n, const Eigen::Vector3d& l, const Eigen::Vector3d& v)>;

inline double lambert(const Eigen::Vector3d& n, const Eigen::Vector3d& l, const Eigen::Vector3d&) {
    return 0.6 * std::max(0.0, n.dot(l));
}

/// `count` distant lights on a spiral between 10 and `lowest_deg` degrees from the camera's axis.
inline Lights spiral_lights(int count, double lowest_deg = 60) {
    Lights lights;
    const double top = std::cos(10 * std::numbers::pi / 180), low = std::cos(lowest_deg * std::numbers::pi / 180);
    for (int i = 0; i < count; ++i) {
        const double z = top + (low - top) * (i + 0.5) / count, r = std::sqrt(1 - z * z), turn = 2.39996 * i;
        Light light;
        light.file = "light" + std::to_string(i);
        light.direction = {r * std::cos(turn), r * std::sin(turn), z};
        lights.push_back(light);
    }
    return lights;
}

/// An orthographic picture of a sphere, a pixel of which is a point: truth is exact.
class LitSphere {
public:
    LitSphere(Lights given, const Reflect& reflect, int side = 48, double largest_slant_deg = 85)
        : lights(std::move(given)), side_(side), radius_(0.49 * side), lowest_(std::cos(largest_slant_deg * degree)) {
        stack.mask = cv::Mat1b(side, side, uchar{0});
        for (int y = 0; y < side; ++y)
            for (int x = 0; x < side; ++x)
                if (normal(y, x).z() > lowest_) stack.mask(y, x) = 255;
        for (const Light& light : lights) {
            stack.images.push_back(photograph(light, reflect));
            stack.clipped.emplace_back(side, side, uchar{0});
            stack.files.push_back(light.file);
        }
    }

    /// z < 0 beside the sphere.
    Eigen::Vector3d normal(int row, int column) const {
        const double x = (column - 0.5 * (side_ - 1)) / radius_, y = (0.5 * (side_ - 1) - row) / radius_;
        const double zz = 1 - x * x - y * y;
        return zz > 0 ? Eigen::Vector3d(x, y, std::sqrt(zz)) : Eigen::Vector3d(0, 0, -1);
    }
    /// The sphere's centre is the viewer frame's origin; a pixel is a millimetre.
    ViewGeometry view() const { return {1.0, {0.5 * (side_ - 1), 0.5 * (side_ - 1)}}; }
    cv::Mat1f height_mm() const {
        cv::Mat1f height(side_, side_, 0.0F);
        for (int y = 0; y < side_; ++y)
            for (int x = 0; x < side_; ++x)
                height(y, x) = static_cast<float>(radius_ * std::max(0.0, normal(y, x).z()));
        return height;
    }

    /// Photons and read noise on each channel.
    void add_noise(const NoiseModel& noise, unsigned seed) {
        std::mt19937_64 bits(seed);
        std::normal_distribution<double> standard;
        for (cv::Mat3f& image : stack.images)
            for (cv::Vec3f& p : image)
                for (int c = 0; c < 3; ++c)
                    p[c] += static_cast<float>(std::sqrt(noise.variance(static_cast<double>(p[c]))) * standard(bits));
    }

    std::vector<double> errors_deg(const PhotometricStereoResult& result) const {
        std::vector<double> errors;
        for (int y = 0; y < side_; ++y)
            for (int x = 0; x < side_; ++x)
                if (stack.mask(y, x)) errors.push_back(error_deg(result, y, x));
        return errors;
    }
    double error_deg(const PhotometricStereoResult& result, int y, int x) const {
        const cv::Vec3f& n = result.normals.normal(y, x);
        return result.normals.valid(y, x) ? angle_deg({n[0], n[1], n[2]}, normal(y, x)) : 90.0;
    }

    Lights lights;
    PhotoStack stack;

private:
    static constexpr double degree = std::numbers::pi / 180;

    cv::Mat3f photograph(const Light& light, const Reflect& reflect) const {
        cv::Mat3f image(side_, side_, cv::Vec3f::all(0));
        for (int y = 0; y < side_; ++y)
            for (int x = 0; x < side_; ++x) {
                const Eigen::Vector3d n = normal(y, x);
                if (n.z() < 0) continue;
                const Incidence there = incidence(light, n * radius_);
                const double radiance =
                    n.dot(there.direction) > 0 ? reflect(n, there.direction, {0, 0, 1}) * there.falloff : 0.0;
                for (int c = 0; c < 3; ++c) image(y, x)[c] = static_cast<float>(radiance * light.intensity[c]);
            }
        return image;
    }

    int side_;
    double radius_;
    double lowest_;
};

inline double mean_of(const std::vector<double>& values) {
    double sum = 0;
    for (const double v : values) sum += v;
    return sum / static_cast<double>(values.size());
}

inline double quantile(std::vector<double> values, double share) {
    const auto place = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), place, values.end());
    return *place;
}

}  // namespace darkbox::test
