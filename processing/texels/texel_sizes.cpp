#include "processing/texels/texel_sizes.h"

#include <algorithm>
#include <iterator>
#include <limits>

#include "processing/texels/neighbourhood.h"

namespace darkbox {
namespace {

constexpr int most_parts = 256;  ///< of one texel at a time

struct ColourSum {
    cv::Vec3d sum{0, 0, 0};
    double pixels = 0;

    cv::Vec3d mean() const { return sum / pixels; }
};

ColourSum colour_sum(const AlbedoMap& albedo, const TexelPixels& texel) {
    ColourSum colour;
    for (const cv::Point& pixel : texel) colour.sum += cv::Vec3d(albedo.albedo(pixel));
    colour.pixels = static_cast<double>(texel.size());
    return colour;
}

/// The other texel, of those that are left, with the nearest mean.
std::size_t most_alike(const std::vector<ColourSum>& colours, std::size_t texel) {
    const cv::Vec3d mean = colours[texel].mean();
    std::size_t best = texel;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t other = 0; other < colours.size(); ++other) {
        if (other == texel || colours[other].pixels == 0) continue;
        const cv::Vec3d difference = colours[other].mean() - mean;
        if (difference.dot(difference) < least) {
            least = difference.dot(difference);
            best = other;
        }
    }
    return best;
}

bool by_row(const cv::Point& a, const cv::Point& b) { return a.y != b.y ? a.y < b.y : a.x < b.x; }

TexelPixels joined(const TexelPixels& a, const TexelPixels& b) {
    TexelPixels both;
    both.reserve(a.size() + b.size());
    std::merge(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(both), by_row);
    return both;
}

}  // namespace

std::vector<TexelPixels> split(const TexelPixels& pixels, const KMeansResult& clusters) {
    std::vector<TexelPixels> groups(clusters.centres.rows);
    for (std::size_t i = 0; i < pixels.size(); ++i) groups[clusters.label[i]].push_back(pixels[i]);
    return groups;
}

std::vector<TexelPixels> without_large(const AlbedoMap& albedo, std::vector<TexelPixels> texels,
                                       const TexelOptions& options) {
    if (options.max_pixels == 0) return texels;
    const auto limit = static_cast<std::size_t>(options.max_pixels);
    std::vector<TexelPixels> done;
    std::reverse(texels.begin(), texels.end());
    while (!texels.empty()) {
        TexelPixels texel = std::move(texels.back());
        texels.pop_back();
        if (texel.size() <= limit) {
            done.push_back(std::move(texel));
            continue;
        }
        const auto parts = static_cast<int>(std::min<std::size_t>(most_parts, (texel.size() + limit - 1) / limit));
        std::vector<TexelPixels> parted = split(
            texel, kmeans(Neighbourhoods(albedo, texel, options.window), {parts, options.iterations, options.seed}));
        auto& next = parted.size() == 1 ? done : texels;  // equal windows cannot be told apart
        std::move(parted.rbegin(), parted.rend(), std::back_inserter(next));
    }
    return done;
}

std::vector<TexelPixels> without_small(const AlbedoMap& albedo, std::vector<TexelPixels> texels, int min_pixels) {
    std::vector<ColourSum> colours;
    for (const TexelPixels& texel : texels) colours.push_back(colour_sum(albedo, texel));
    const auto smaller = [](const TexelPixels& a, const TexelPixels& b) {
        if (a.empty() != b.empty()) return b.empty();
        return a.size() < b.size();
    };
    for (std::size_t left = texels.size(); left > 1; --left) {
        const auto smallest =
            static_cast<std::size_t>(std::min_element(texels.begin(), texels.end(), smaller) - texels.begin());
        if (texels[smallest].size() >= static_cast<std::size_t>(min_pixels)) break;
        const std::size_t other = most_alike(colours, smallest);
        texels[other] = joined(texels[other], texels[smallest]);
        colours[other].sum += colours[smallest].sum;
        colours[other].pixels += colours[smallest].pixels;
        texels[smallest].clear();
        colours[smallest] = {};
    }
    std::erase_if(texels, [](const TexelPixels& texel) { return texel.empty(); });
    return texels;
}

}  // namespace darkbox
