#include "rig/capture/metered_picture.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "rig/capture/picture.h"

namespace darkbox {
namespace {

constexpr std::size_t most_pixels = 200'000;
constexpr double share_below = 0.999;

}  // namespace

std::vector<float> metered_pixels(const Frame& frame) {
    const Picture picture = to_picture(frame);
    const std::size_t count = static_cast<std::size_t>(frame.width) * static_cast<std::size_t>(frame.height);
    const std::size_t every = (count + most_pixels - 1) / most_pixels | 1U;  // odd: all places of a mosaic come
    const auto colours = static_cast<std::ptrdiff_t>(picture.columns / frame.width);
    const double scale = 1 / (std::exp2(frame.bit_depth) - 1 - frame.black_level);
    std::vector<float> pixels;
    pixels.reserve(count / every + 1);
    for (std::size_t pixel = 0; pixel < count; pixel += every) {
        const auto first = picture.samples.begin() + static_cast<std::ptrdiff_t>(pixel) * colours;
        pixels.push_back(static_cast<float>((*std::max_element(first, first + colours) - frame.black_level) * scale));
    }
    return pixels;
}

std::vector<bool> object_pixels(const std::vector<std::vector<float>>& lamps) {
    std::vector<double> mean(lamps.front().size(), 0.0);
    for (const std::vector<float>& pixels : lamps)
        for (std::size_t i = 0; i < mean.size(); ++i) mean[i] += pixels[i] / static_cast<double>(lamps.size());
    constexpr std::size_t bins = 512;
    const double most = std::max(*std::max_element(mean.begin(), mean.end()), 1e-9);
    const auto bin_of = [&](double value) {
        return static_cast<std::size_t>(std::clamp(value / most, 0.0, 1.0) * (bins - 1));
    };
    std::array<double, bins> histogram{};
    double total = 0;
    for (const double value : mean) {
        histogram.at(bin_of(value)) += 1;
        total += static_cast<double>(bin_of(value));
    }
    const auto count = static_cast<double>(mean.size());
    double below = 0, sum_below = 0, best = -1;
    std::size_t threshold = 0;
    for (std::size_t bin = 0; bin + 1 < bins; ++bin) {
        below += histogram.at(bin);
        sum_below += static_cast<double>(bin) * histogram.at(bin);
        if (below == 0 || below == count) continue;
        const double apart = sum_below / below - (total - sum_below) / (count - below);
        const double between = below * (count - below) * apart * apart;
        if (between > best) {
            best = between;
            threshold = bin;
        }
    }
    std::vector<bool> object(mean.size());
    for (std::size_t i = 0; i < mean.size(); ++i) object[i] = bin_of(mean[i]) > threshold;
    return object;
}

double object_level(const std::vector<float>& pixels, const std::vector<bool>& object) {
    std::vector<float> of_object;
    for (std::size_t i = 0; i < pixels.size(); ++i)
        if (object[i]) of_object.push_back(pixels[i]);
    if (of_object.empty()) return 0;
    const auto place = static_cast<std::size_t>(share_below * static_cast<double>(of_object.size() - 1));
    const auto at = of_object.begin() + static_cast<std::ptrdiff_t>(place);
    std::nth_element(of_object.begin(), at, of_object.end());
    return *at;
}

}  // namespace darkbox
