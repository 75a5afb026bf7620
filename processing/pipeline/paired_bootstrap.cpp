#include "processing/pipeline/paired_bootstrap.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "acquisition/frame/error.h"

namespace darkbox {
namespace {

struct Block {
    double sum = 0;  ///< of differences
    std::size_t pixels = 0;
};

std::vector<Block> blocks_of(const cv::Mat1d& first, const cv::Mat1d& second, int side) {
    const int across = (first.cols + side - 1) / side;
    const int down = (first.rows + side - 1) / side;
    std::vector<Block> blocks(static_cast<std::size_t>(across) * static_cast<std::size_t>(down));
    for (int y = 0; y < first.rows; ++y)
        for (int x = 0; x < first.cols; ++x) {
            const double difference = second(y, x) - first(y, x);
            if (std::isnan(difference)) continue;
            Block& block = blocks[static_cast<std::size_t>(y / side * across + x / side)];
            block.sum += difference;
            ++block.pixels;
        }
    std::erase_if(blocks, [](const Block& block) { return block.pixels == 0; });
    return blocks;
}

double mean_of(const Block& total) { return total.sum / static_cast<double>(total.pixels); }

/// The standard library's distributions differ between libraries; the engine itself does not.
std::size_t draw_below(std::mt19937_64& engine, std::size_t count) {
    const double unit = static_cast<double>(engine() >> 11U) * 0x1p-53;
    return static_cast<std::size_t>(unit * static_cast<double>(count));
}

Block resampled(const std::vector<Block>& blocks, std::mt19937_64& engine) {
    Block total;
    for (std::size_t i = 0; i < blocks.size(); ++i) {
        const Block& drawn = blocks[draw_below(engine, blocks.size())];
        total.sum += drawn.sum;
        total.pixels += drawn.pixels;
    }
    return total;
}

}  // namespace

void PairedBootstrapOptions::validate() const {
    if (block_px < 1) throw InputError(fmt::format("block_px is {}", block_px), "allowed: 1 or more pixels");
    if (resamples < 100 || resamples > 1'000'000)
        throw InputError(fmt::format("resamples is {}", resamples), "allowed: 100 to 1000000");
    if (!(confidence > 0 && confidence < 1))
        throw InputError(fmt::format("confidence is {}", confidence), "allowed: above 0 and below 1");
}

PairedBootstrap paired_bootstrap(const cv::Mat1d& first, const cv::Mat1d& second,
                                 const PairedBootstrapOptions& options) {
    options.validate();
    if (first.size() != second.size())
        throw InputError(fmt::format("the maps of errors are {}x{} and {}x{} pixels", first.cols, first.rows,
                                     second.cols, second.rows),
                         "compare maps of one size");
    const std::vector<Block> blocks = blocks_of(first, second, options.block_px);
    if (blocks.size() < 2)
        throw InputError(fmt::format("only {} blocks of {} px hold pixels to compare", blocks.size(), options.block_px),
                         "choose smaller blocks, or a larger object");
    Block total;
    for (const Block& block : blocks) {
        total.sum += block.sum;
        total.pixels += block.pixels;
    }
    std::mt19937_64 engine(options.seed);
    std::vector<double> means(static_cast<std::size_t>(options.resamples));
    for (double& mean : means) mean = mean_of(resampled(blocks, engine));
    std::sort(means.begin(), means.end());
    const auto at = [&](double share) {
        return means[static_cast<std::size_t>(std::lround(share * static_cast<double>(means.size() - 1)))];
    };
    const double tail = (1 - options.confidence) / 2;
    return {mean_of(total), at(tail), at(1 - tail), total.pixels, blocks.size()};
}

}  // namespace darkbox
