#include "processing/texels/texels.h"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <limits>
#include <vector>

#include "acquisition/frame/error.h"
#include "processing/maps/parallel.h"
#include "processing/texels/kmeans.h"
#include "processing/texels/neighbourhood.h"
#include "processing/texels/texel_sizes.h"

namespace darkbox {
namespace {

void require_range(const char* field, int value, int lowest, int highest) {
    if (value < lowest || value > highest)
        throw InputError(fmt::format("texels: {} is {}, allowed are {}...{}", field, value, lowest, highest),
                         fmt::format("set {} within that range", field));
}

bool is_finite(const cv::Vec3f& value) {
    return std::isfinite(value[0]) && std::isfinite(value[1]) && std::isfinite(value[2]);
}

AlbedoMap without_non_finite(const AlbedoMap& albedo) {
    AlbedoMap clean{albedo.albedo, albedo.valid.clone()};
    for (int y = 0; y < clean.valid.rows; ++y)
        for (int x = 0; x < clean.valid.cols; ++x)
            if (!is_finite(clean.albedo(y, x))) clean.valid(y, x) = 0;
    return clean;
}

TexelPixels valid_pixels(const AlbedoMap& albedo) {
    TexelPixels pixels;
    for (int y = 0; y < albedo.valid.rows; ++y)
        for (int x = 0; x < albedo.valid.cols; ++x)
            if (albedo.valid(y, x) != 0) pixels.emplace_back(x, y);
    return pixels;
}

/// The two steps of the thesis.
std::vector<TexelPixels> texels_of(const AlbedoMap& albedo, const TexelPixels& pixels, const TexelOptions& options,
                                   const WorkContext& work) {
    const KMeansResult by_albedo =
        kmeans(Neighbourhoods(albedo, pixels, 1), {options.albedo_clusters, options.iterations, options.seed});
    const std::vector<TexelPixels> groups = split(pixels, by_albedo);
    std::vector<TexelPixels> texels;
    for (std::size_t g = 0; g < groups.size(); ++g) {
        if (work.cancelled()) throw Cancelled("the clustering of texels was stopped", "start it again when it suits");
        work.tell({"texels", g, groups.size(), {}});
        const KMeansResult by_neighbourhood =
            kmeans(Neighbourhoods(albedo, groups[g], options.window),
                   {options.neighbourhood_clusters, options.iterations, options.seed + g + 1});
        for (TexelPixels& texel : split(groups[g], by_neighbourhood)) texels.push_back(std::move(texel));
    }
    work.tell({"texels", groups.size(), groups.size(), {}});
    return texels;
}

IndexMap index_of(const std::vector<TexelPixels>& texels, cv::Size size) {
    IndexMap index{cv::Mat1w(size, 0), static_cast<int>(texels.size())};
    for (std::size_t k = 0; k < texels.size(); ++k)
        for (const cv::Point& pixel : texels[k]) index.label(pixel) = static_cast<std::uint16_t>(k + 1);
    return index;
}

/// Sum of squared RGB distances to the mean.
double scatter(const AlbedoMap& albedo, const TexelPixels& pixels) {
    cv::Vec3d mean(0, 0, 0);
    for (const cv::Point& pixel : pixels) mean += cv::Vec3d(albedo.albedo(pixel));
    mean *= 1.0 / static_cast<double>(pixels.size());
    double sum = 0;
    for (const cv::Point& pixel : pixels) {
        const cv::Vec3d difference = cv::Vec3d(albedo.albedo(pixel)) - mean;
        sum += difference.dot(difference);
    }
    return sum;
}

void require_few(std::size_t texels) {
    constexpr std::size_t most = std::numeric_limits<std::uint16_t>::max();
    if (texels > most)
        throw InputError(fmt::format("there would be {} texels, but an index map holds {}", texels, most),
                         "raise max_pixels or min_pixels, or ask for fewer clusters");
}

void require_pixels(const AlbedoMap& albedo) {
    if (albedo.albedo.size() != albedo.valid.size())
        throw InputError(fmt::format("the albedo map is {}x{} pixels but its mask is {}x{}", albedo.albedo.cols,
                                     albedo.albedo.rows, albedo.valid.cols, albedo.valid.rows),
                         "give an albedo map and a mask of one size");
    if (albedo.albedo.empty()) throw InputError("the albedo map is empty", "compute the normals and albedo first");
}

}  // namespace

void TexelOptions::validate() const {
    require_range("albedo_clusters", albedo_clusters, 1, 256);
    require_range("neighbourhood_clusters", neighbourhood_clusters, 1, 256);
    require_range("window", window, 1, 15);
    if (window % 2 == 0)
        throw InputError(fmt::format("texels: window is {}, but it must be odd (1...15)", window),
                         "set window to an odd number of pixels, such as 5");
    require_range("iterations", iterations, 1, 1000);
    constexpr int most_pixels = std::numeric_limits<int>::max();
    require_range("min_pixels", min_pixels, 1, most_pixels);
    require_range("max_pixels", max_pixels, 0, most_pixels);
    if (max_pixels > 0 && max_pixels < min_pixels)
        throw InputError(fmt::format("texels: max_pixels is {}, less than min_pixels, {}", max_pixels, min_pixels),
                         "set max_pixels to at least min_pixels, or to 0 for no limit");
    require_range("albedo_clusters x neighbourhood_clusters", albedo_clusters * neighbourhood_clusters, 1,
                  std::numeric_limits<std::uint16_t>::max());
}

TexelResult cluster_texels(const AlbedoMap& albedo, const TexelOptions& options, const WorkContext& work) {
    const auto start = std::chrono::steady_clock::now();
    options.validate();
    require_pixels(albedo);
    const AlbedoMap clean = without_non_finite(albedo);
    const TexelPixels pixels = valid_pixels(clean);
    if (pixels.empty())
        throw InputError("the albedo map has no valid pixel", "check the mask: it must be white on the object");

    const auto texels = on_threads_of(work, [&] {
        auto found = without_large(clean, texels_of(clean, pixels, options, work), options);
        return without_small(clean, std::move(found), options.min_pixels);
    });
    require_few(texels.size());

    TexelResult result;
    result.index = index_of(texels, albedo.albedo.size());
    double within = 0;
    for (const TexelPixels& texel : texels) within += scatter(clean, texel);
    const double total = scatter(clean, pixels);
    result.within_cluster_variance = within / static_cast<double>(pixels.size());
    result.variance_explained = total > 0 ? std::max(0.0, 1.0 - within / total) : 1.0;
    result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return result;
}

}  // namespace darkbox
