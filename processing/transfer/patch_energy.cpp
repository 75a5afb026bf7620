#include "processing/transfer/patch_energy.h"

#include <tbb/parallel_for.h>

#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "processing/transfer/nearest.h"

namespace darkbox {
namespace {

/// Numbers of a feature come in as many lanes.
constexpr std::size_t lanes = 8;
/// Half the usual: the tree is what takes most memory in a transfer, and half of its components rule out nearly as
/// much.
constexpr std::size_t components = 8;

cv::Mat3b encoded_normals(const NormalMap& normals) {
    cv::Mat3b bytes;
    normals.normal.convertTo(bytes, CV_8U, 127.5, 127.5);
    return bytes;
}

std::vector<cv::Point> pixels_of(const cv::Mat1b& valid) {
    std::vector<cv::Point> pixels;
    cv::findNonZero(valid, pixels);
    return pixels;
}

/// Row by row, so that a patch that has turned out farther than `limit` is given up.
float squared_difference(const PatchLayers& a, cv::Point p, const PatchLayers& b, cv::Point q, int window,
                         float limit) {
    const auto bytes = window * static_cast<int>(a.bytes.elemSize());
    const int radius = window / 2;
    int sum = 0;
    for (int dy = -radius; dy <= radius && static_cast<float>(sum) < limit; ++dy) {
        const std::uint8_t* s = a.bytes.ptr(p.y + dy, p.x - radius);
        const std::uint8_t* t = b.bytes.ptr(q.y + dy, q.x - radius);
        for (int i = 0; i < bytes; ++i) {
            const int difference = s[i] - t[i];
            sum += difference * difference;
        }
    }
    return static_cast<float>(sum);
}

void read_patch(const PatchLayers& layers, cv::Point p, int window, Feature& patch) {
    const auto bytes = window * static_cast<int>(layers.bytes.elemSize());
    patch.value.clear();
    for (int dy = -(window / 2); dy <= window / 2; ++dy) {
        const std::uint8_t* row = layers.bytes.ptr(p.y + dy, p.x - window / 2);
        patch.value.insert(patch.value.end(), row, row + bytes);
    }
    patch.value.resize((patch.value.size() + lanes - 1) / lanes * lanes, 0.0F);
}

}  // namespace

PatchLayers colour_patches(const Appearance& appearance, int window) {
    return {appearance.picture, inner_pixels(appearance.normals.valid, window / 2)};
}

PatchLayers joint_patches(const Appearance& appearance, int window) {
    const std::vector<cv::Mat> layers{appearance.picture, encoded_normals(appearance.normals)};
    PatchLayers result{{}, inner_pixels(appearance.normals.valid, window / 2)};
    cv::merge(layers, result.bytes);
    return result;
}

std::optional<double> patch_energy(const PatchLayers& source, const PatchLayers& target, int window, int stride) {
    const std::vector<cv::Point> sources = pixels_of(source.inside);
    std::vector<cv::Point> targets;
    const int first = stride / 4;
    for (const cv::Point& p : pixels_of(target.inside))
        if (p.x % stride == first && p.y % stride == first) targets.push_back(p);
    if (sources.empty() || targets.empty()) return std::nullopt;
    const auto reader = [&](std::size_t i, Feature& patch) { read_patch(source, sources[i], window, patch); };
    const NearestFeatures nearest(sources.size(), reader, 0, components);
    const int numbers = 3 * window * window;
    std::vector<double> energies(targets.size());
    tbb::parallel_for(std::size_t{0}, targets.size(), [&](std::size_t i) {
        thread_local Feature patch;
        thread_local std::vector<float> query;
        read_patch(target, targets[i], window, patch);
        const Match match = nearest.nearest(
            patch,
            [&](int point, float limit) {
                return squared_difference(source, sources[static_cast<std::size_t>(point)], target, targets[i], window,
                                          limit);
            },
            query);
        energies[i] = std::sqrt(static_cast<double>(match.squared_distance) / numbers);
    });
    double sum = 0;
    for (const double energy : energies) sum += energy;
    return sum / static_cast<double>(targets.size());
}

}  // namespace darkbox
