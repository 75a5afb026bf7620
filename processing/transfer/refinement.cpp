#include "processing/transfer/refinement.h"

#include <tbb/parallel_for.h>

#include <cstring>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "processing/transfer/balance.h"
#include "processing/transfer/counter_hash.h"
#include "processing/transfer/refine_row.h"

namespace darkbox {
namespace {

/// Weights of what refine_row() adds up, for patches of 5 x 5 pixels.
constexpr float vote_weight = 40;
constexpr float cut_cost = 340;

/// The last pass of all closes seams: cuts and votes count more, and nothing new comes in but where it is far better.
constexpr float last_vote_weight = 1.5F * vote_weight;
constexpr float last_cut_cost = 4 * cut_cost;
constexpr float last_incoherence = 100;

cv::Mat1b whole_windows(const cv::Mat1b& valid, int window) {
    cv::Mat1b whole;
    cv::erode(valid, whole, cv::Mat1b(window, window, std::uint8_t{1}), cv::Point(-1, -1), 1, cv::BORDER_CONSTANT,
              cv::Scalar(0));
    return whole;
}

/// One level: its coordinates, and the target's bytes as they read through them.
class LevelRefinement {
public:
    LevelRefinement(const RefinementLevel& level, cv::Mat2i coordinates, const TexelCode& code,
                    const TransferOptions& options)
        : source_(level.source),
          target_(level.target),
          source_bytes_(texel_bytes(source_, level.source_control, code)),
          target_bytes_(texel_bytes(target_, level.target_control, code)),
          table_(level.table),
          bin_(normal_bin_map(target_)),
          whole_(whole_windows(target_.valid, options.window)),
          balance_(source_, source_bytes_, target_, table_, level.level, balance_options(options)),
          coordinates_(std::move(coordinates)),
          next_(target_.valid.size()),
          options_(options),
          level_(level.level) {
        tbb::parallel_for(0, coordinates_.rows, [&](int y) { read_row(y, 0, 1, coordinates_); });
    }

    void pass(int number) {
        balance_.observe(coordinates_, target_bytes_);
        const bool last = level_ == 0 && number == options_.passes - 1;
        const float patches = patches_of(options_);
        const Refinement refinement{source_,
                                    source_bytes_,
                                    table_,
                                    bin_,
                                    target_,
                                    target_bytes_,
                                    whole_,
                                    coordinates_,
                                    balance_,
                                    options_.window,
                                    (last ? last_vote_weight : vote_weight) * patches,
                                    (last ? last_cut_cost : cut_cost) * patches,
                                    last ? last_incoherence : static_cast<float>(1 + options_.kappa),
                                    options_.seed * 4096 + static_cast<std::uint64_t>(level_ * 256 + number * 8)};
        for (int i = 0; i < 4; ++i) {
            const int pixel_class = number % 2 == 0 ? i : 3 - i;
            refine_class(refinement, pixel_class % 2, pixel_class / 2);
        }
    }

    const cv::Mat2i& coordinates() const { return coordinates_; }

private:
    const MapLevel& source_;
    const MapLevel& target_;
    TexelBytes source_bytes_;
    TexelBytes target_bytes_;
    const NormalTable& table_;
    cv::Mat1i bin_;
    cv::Mat1b whole_;
    TextureBalance balance_;
    cv::Mat2i coordinates_;
    cv::Mat2i next_;
    const TransferOptions& options_;
    int level_;

    /// How many times larger than 5 x 5 a patch is.
    static float patches_of(const TransferOptions& options) {
        return static_cast<float>(options.window * options.window) / 25;
    }

    static BalanceOptions balance_options(const TransferOptions& options) {
        BalanceOptions balance;
        const float patches = patches_of(options);
        balance.usage *= patches;
        balance.histogram *= patches;
        balance.colour *= patches;
        return balance;
    }

    void read_row(int y, int first, int step, const cv::Mat2i& from) {
        for (int x = first; x < coordinates_.cols; x += step) {
            if (!target_.valid(y, x)) continue;
            coordinates_(y, x) = from(y, x);
            std::memcpy(target_bytes_.at({x, y}), source_bytes_.at(cv::Point(from(y, x))), 3);
        }
    }

    void refine_class(const Refinement& refinement, int first_x, int first_y) {
        const int rows = (coordinates_.rows - first_y + 1) / 2;
        tbb::parallel_for(0, rows, [&](int i) {
            const int y = first_y + 2 * i;
            refine_row(refinement, y, first_x, next_.ptr<cv::Vec2i>(y));
        });
        tbb::parallel_for(0, rows, [&](int i) { read_row(first_y + 2 * i, first_x, 2, next_); });
    }
};

}  // namespace

cv::Mat2i refine_level(const RefinementLevel& level, cv::Mat2i coordinates, const TexelCode& code,
                       const TransferOptions& options, const PassDone& pass_done) {
    if (options.passes == 0) return coordinates;
    LevelRefinement refinement(level, std::move(coordinates), code, options);
    for (int pass = 0; pass < options.passes; ++pass) {
        refinement.pass(pass);
        pass_done();
    }
    return refinement.coordinates();
}

}  // namespace darkbox
