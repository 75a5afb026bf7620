#include "processing/transfer/coverage.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "processing/transfer/normal_table.h"

namespace darkbox {
namespace {

/// A bin is about three degrees wide, so that a dozen of its normals stand for all of them to less than one.
constexpr std::size_t samples_of_a_bin = 12;

std::vector<std::vector<cv::Vec3f>> sampled(const MapLevel& source, const NormalTable& table) {
    std::vector<std::vector<cv::Vec3f>> samples(normal_bins);
    for (int bin = 0; bin < normal_bins; ++bin) {
        const auto pixels = table.pixels(bin);
        const std::size_t count = std::min(samples_of_a_bin, pixels.size());
        for (std::size_t i = 0; i < count; ++i)
            samples[bin].push_back(source.normal(pixels[i * pixels.size() / count]));
    }
    return samples;
}

}  // namespace

cv::Mat1f uncovered_deg(const MapLevel& source, const MapLevel& target) {
    const NormalTable table(source);
    const std::vector<std::vector<cv::Vec3f>> samples = sampled(source, table);
    const auto nearest_in = [&](int bin, const cv::Vec3f& normal) {
        float squared = 4;
        for (const cv::Vec3f& sample : samples[bin]) {
            const cv::Vec3f off = sample - normal;
            squared = std::min(squared, off.dot(off));
        }
        return squared;
    };
    cv::Mat1f angle(target.valid.size(), 0.0F);
    tbb::parallel_for(0, angle.rows, [&](int y) {
        for (int x = 0; x < angle.cols; ++x) {
            if (!target.valid(y, x)) continue;
            const cv::Vec3f& normal = target.normal(y, x);
            const int bin = table.filled_bin(normal_bin(normal));
            float squared = nearest_in(bin, normal);
            for (const int step : {-1, 1, -normal_bin_side, normal_bin_side})
                if (bin + step >= 0 && bin + step < normal_bins)
                    squared = std::min(squared, nearest_in(bin + step, normal));
            const float half_sine = std::min(1.0F, std::sqrt(squared) / 2);
            angle(y, x) = 2 * std::asin(half_sine) * (180 / std::numbers::pi_v<float>);
        }
    });
    return angle;
}

}  // namespace darkbox
