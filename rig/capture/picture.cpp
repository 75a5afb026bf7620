#include "rig/capture/picture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <numeric>

namespace darkbox {
namespace {

constexpr double wanted_blocks = 300;  ///< enough for a steady mean of their ratios
constexpr int largest_block = 16;      ///< samples a side

/// Sum over a block of the difference, and of the variance that noise gives it.
struct BlockSums {
    double difference = 0.0;
    double variance = 0.0;
};

/// Adds up a NoiseRatio. The square of a normal deviate has twice its variance's square as its own variance.
struct RatioSums {
    double squared = 0.0;
    double variance = 0.0;
    double variance_squared = 0.0;

    void add(double difference, double its_variance) {
        squared += difference * difference;
        variance += its_variance;
        variance_squared += its_variance * its_variance;
    }
    NoiseRatio ratio() const { return {squared / variance, std::sqrt(2 * variance_squared) / variance}; }
};

/// Sums in so many lanes do not wait for each other, and fit a processor's vectors.
constexpr std::size_t lanes = 8;

int block_side(const Picture& picture) {
    const double area = static_cast<double>(picture.columns) * picture.rows;
    return std::clamp(static_cast<int>(std::sqrt(area / wanted_blocks)), 1, largest_block);
}

std::size_t at(const Picture& picture, int row, int column) {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(picture.columns) + static_cast<std::size_t>(column);
}

/// A stretch of at most `largest_block` samples: how two scaled signals differ, and by what variance noise lets them.
void add_differences(const std::uint16_t* a, const std::uint16_t* b, const std::uint16_t* dark, std::size_t count,
                     double gain, const NoiseModel& noise, BlockSums& block, RatioSums& pixels) {
    std::array<double, lanes> difference{}, variance{}, squared{}, variance_squared{};
    const double scale = 1 + gain * gain;
    const auto add = [&](std::size_t lane, std::size_t i) {
        const double signal_a = static_cast<double>(static_cast<int>(a[i]) - static_cast<int>(dark[i]));
        const double signal_b = gain * static_cast<double>(static_cast<int>(b[i]) - static_cast<int>(dark[i]));
        const double d = signal_a - signal_b;
        const double v = noise.variance((signal_a + signal_b) / 2) * scale;
        difference[lane] += d;
        variance[lane] += v;
        squared[lane] += d * d;
        variance_squared[lane] += v * v;
    };
    std::size_t i = 0;
    for (; i + lanes <= count; i += lanes)
        for (std::size_t lane = 0; lane < lanes; ++lane) add(lane, i + lane);
    for (; i < count; ++i) add(0, i);
    for (std::size_t lane = 0; lane < lanes; ++lane) {
        block.difference += difference[lane];
        block.variance += variance[lane];
        pixels.squared += squared[lane];
        pixels.variance += variance[lane];
        pixels.variance_squared += variance_squared[lane];
    }
}

/// Chroma says nothing of how much light there was.
Picture luma_of(const Frame& frame) {
    Picture picture{frame.width, frame.height, {}};
    const std::size_t count = static_cast<std::size_t>(frame.width) * static_cast<std::size_t>(frame.height);
    picture.samples.reserve(count);
    for (std::size_t i = 0; i < count; ++i)
        picture.samples.push_back(std::to_integer<std::uint16_t>(frame.pixels[2 * i]));
    return picture;
}

}  // namespace

Picture to_picture(const Frame& frame) {
    if (frame.format == PixelFormat::ycc8) return luma_of(frame);
    Picture picture{frame.width * channels(frame.format), frame.height, {}};
    const std::size_t count = static_cast<std::size_t>(picture.columns) * static_cast<std::size_t>(picture.rows);
    picture.samples.resize(count);
    if (bytes_per_sample(frame.format) == 2) {
        std::memcpy(picture.samples.data(), frame.pixels.data(), count * 2);
    } else {
        std::transform(frame.pixels.begin(), frame.pixels.begin() + static_cast<std::ptrdiff_t>(count),
                       picture.samples.begin(), [](std::byte b) { return std::to_integer<std::uint16_t>(b); });
    }
    return picture;
}

double mean(const Picture& picture) {
    const auto sum = std::accumulate(picture.samples.begin(), picture.samples.end(), std::uint64_t{0});
    return static_cast<double>(sum) / static_cast<double>(std::max<std::size_t>(picture.samples.size(), 1));
}

Picture shrink(const Picture& picture) {
    const int side = block_side(picture);
    Picture small{picture.columns / side, picture.rows / side, {}};
    for (int row = 0; row < small.rows; ++row) {
        for (int column = 0; column < small.columns; ++column) {
            std::uint64_t sum = 0;
            for (int y = 0; y < side; ++y)
                for (int x = 0; x < side; ++x) sum += picture.samples[at(picture, row * side + y, column * side + x)];
            small.samples.push_back(static_cast<std::uint16_t>(sum / static_cast<std::uint64_t>(side * side)));
        }
    }
    return small;
}

NoiseModel measure_noise(const Picture& a, const Picture& b, const Picture& dark, double full_scale) {
    const double dark_mean = mean(dark);
    const double gain = (mean(a) - dark_mean) / (mean(b) - dark_mean);
    // A straight line through (signal, variance), by least squares over all samples.
    double n = 0, sum_s = 0, sum_v = 0, sum_ss = 0, sum_sv = 0;
    for (std::size_t i = 0; i < a.samples.size(); ++i) {
        if (a.samples[i] >= full_scale || b.samples[i] >= full_scale) continue;
        const double signal_a = static_cast<double>(a.samples[i]) - dark.samples[i];
        const double signal_b = gain * (static_cast<double>(b.samples[i]) - dark.samples[i]);
        const double signal = (signal_a + signal_b) / 2;
        const double variance = (signal_a - signal_b) * (signal_a - signal_b) / (1 + gain * gain);
        n += 1;
        sum_s += signal;
        sum_v += variance;
        sum_ss += signal * signal;
        sum_sv += signal * variance;
    }
    NoiseModel noise;
    if (n == 0) return noise;
    const double spread = sum_ss - sum_s * sum_s / n;
    noise.slope = spread > 0 ? std::max(0.0, (sum_sv - sum_s * sum_v / n) / spread) : 0.0;
    noise.floor = std::max(noise.floor, (sum_v - noise.slope * sum_s) / n);
    return noise;
}

Difference compare(const Picture& a, const Picture& b, const Picture& dark, const NoiseModel& noise) {
    Difference result;
    const double dark_mean = mean(dark);
    result.gain = (mean(a) - dark_mean) / (mean(b) - dark_mean);
    const auto side = static_cast<std::size_t>(block_side(a));
    const auto columns = static_cast<std::size_t>(a.columns);
    std::vector<BlockSums> blocks((columns + side - 1) / side);  // of one row of blocks
    RatioSums pixels, sums;
    for (int row = 0; row < a.rows; ++row) {
        const std::size_t first = at(a, row, 0);
        for (std::size_t block = 0; block < blocks.size(); ++block) {
            const std::size_t begin = first + block * side;
            const std::size_t count = std::min(side, columns - block * side);
            add_differences(&a.samples[begin], &b.samples[begin], &dark.samples[begin], count, result.gain, noise,
                            blocks[block], pixels);
        }
        const bool ends = (static_cast<std::size_t>(row) + 1) % side == 0 || row + 1 == a.rows;
        if (!ends) continue;
        for (BlockSums& block : blocks) sums.add(block.difference, block.variance);
        std::fill(blocks.begin(), blocks.end(), BlockSums{});
    }
    result.pixels = pixels.ratio();
    result.blocks = sums.ratio();
    return result;
}

/// Four sums that do not wait for each other, of eight bytes each.
std::uint64_t hash_of(std::span<const std::byte> bytes) {
    constexpr std::uint64_t factor = 0x9e3779b97f4a7c15U;
    const auto mix = [](std::uint64_t hash, std::uint64_t word) {
        hash = (hash ^ word) * factor;
        return hash ^ hash >> 29U;
    };
    std::array<std::uint64_t, 4> words{}, hashes{1, 2, 3, 4};
    std::size_t i = 0;
    for (; i + sizeof words <= bytes.size(); i += sizeof words) {
        std::memcpy(words.data(), bytes.data() + i, sizeof words);
        for (std::size_t lane = 0; lane < words.size(); ++lane) hashes[lane] = mix(hashes[lane], words[lane]);
    }
    words = {};
    std::memcpy(words.data(), bytes.data() + i, bytes.size() - i);
    std::uint64_t hash = bytes.size();
    for (std::size_t lane = 0; lane < words.size(); ++lane) hash = mix(mix(hash, words[lane]), hashes[lane]);
    return hash;
}

double correlation(const Picture& lit, const Picture& brightened_dark, const Picture& dark) {
    double aa = 0, bb = 0, ab = 0;
    for (std::size_t i = 0; i < lit.samples.size(); ++i) {
        const double a = static_cast<double>(lit.samples[i]) - dark.samples[i];
        const double b = static_cast<double>(brightened_dark.samples[i]) - dark.samples[i];
        aa += a * a;
        bb += b * b;
        ab += a * b;
    }
    return aa > 0 && bb > 0 ? ab / std::sqrt(aa * bb) : 0.0;
}

}  // namespace darkbox
