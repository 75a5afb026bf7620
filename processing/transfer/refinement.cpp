#include "processing/transfer/refinement.h"

#include <tbb/parallel_for.h>

#include <cstring>
#include <opencv2/imgproc.hpp>
#include <vector>

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
    LevelRefinement(const RefinementLevel& level, const cv::Mat2i& coordinates, const RefinementPlan& plan,
                    const TexelCode& code, const TransferOptions& options)
        : source_(level.source),
          target_(level.target),
          source_bytes_(texel_bytes(source_, level.source_control, code)),
          target_bytes_(texel_bytes(target_, level.target_control, code)),
          table_(level.table),
          bin_(normal_bin_map(target_)),
          whole_(whole_windows(target_.valid, options.window)),
          balance_(source_, source_bytes_, target_, table_, level.level, balance_options(options, plan.colour_weight)),
          places_(static_cast<std::size_t>(target_bytes_.places()), source_bytes_.nowhere()),
          next_(places_),
          options_(options),
          passes_(plan.passes),
          level_(level.level) {
        each_valid([&](cv::Point p) {
            next_[at(p)] = source_bytes_.place(cv::Point(coordinates(p)));
            take_next(p);
        });
    }

    void pass(int number) {
        balance_.observe(places_, target_bytes_);
        const bool last = level_ == 0 && number == passes_ - 1;
        const float patches = patches_of(options_);
        const Refinement refinement{source_,
                                    source_bytes_,
                                    table_,
                                    bin_,
                                    target_,
                                    target_bytes_,
                                    whole_,
                                    places_,
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

    cv::Mat2i coordinates() const {
        cv::Mat2i all(target_.valid.size(), cv::Vec2i(-1, -1));
        each_valid([&](cv::Point p) {
            const cv::Point source = source_bytes_.point(places_[at(p)]);
            all(p) = cv::Vec2i(source.x, source.y);
        });
        return all;
    }

private:
    const MapLevel& source_;
    const MapLevel& target_;
    TexelBytes source_bytes_;
    TexelBytes target_bytes_;
    const NormalTable& table_;
    cv::Mat1i bin_;
    cv::Mat1b whole_;
    TextureBalance balance_;
    std::vector<int> places_;  ///< in the source, at each place of the target
    std::vector<int> next_;
    const TransferOptions& options_;
    int passes_;
    int level_;

    /// How many times larger than 5 x 5 a patch is.
    static float patches_of(const TransferOptions& options) {
        return static_cast<float>(options.window * options.window) / 25;
    }

    static BalanceOptions balance_options(const TransferOptions& options, float colour_weight) {
        BalanceOptions balance;
        const float patches = patches_of(options);
        balance.usage *= patches;
        balance.histogram *= patches;
        balance.colour *= patches * colour_weight;
        return balance;
    }

    std::size_t at(cv::Point p) const { return static_cast<std::size_t>(target_bytes_.place(p)); }

    template <class Visit>
    void each_valid(const Visit& visit) const {
        tbb::parallel_for(0, target_.valid.rows, [&](int y) {
            for (int x = 0; x < target_.valid.cols; ++x)
                if (target_.valid(y, x)) visit(cv::Point(x, y));
        });
    }

    void take_next(cv::Point p) {
        places_[at(p)] = next_[at(p)];
        std::memcpy(target_bytes_.at(p), source_bytes_.at(next_[at(p)]), 3);
    }

    void refine_class(const Refinement& refinement, int first_x, int first_y) {
        const int rows = (target_.valid.rows - first_y + 1) / 2;
        tbb::parallel_for(0, rows, [&](int i) {
            const int y = first_y + 2 * i;
            refine_row(refinement, y, first_x, next_.data() + at({0, y}));
        });
        tbb::parallel_for(0, rows, [&](int i) {
            const int y = first_y + 2 * i;
            for (int x = first_x; x < target_.valid.cols; x += 2)
                if (target_.valid(y, x)) take_next({x, y});
        });
    }
};

}  // namespace

cv::Mat2i refine_level(const RefinementLevel& level, const cv::Mat2i& coordinates, const RefinementPlan& plan,
                       const TexelCode& code, const TransferOptions& options, const PassDone& pass_done) {
    if (plan.passes == 0) return coordinates;
    LevelRefinement refinement(level, coordinates, plan, code, options);
    for (int pass = 0; pass < plan.passes; ++pass) {
        refinement.pass(pass);
        pass_done();
    }
    return refinement.coordinates();
}

}  // namespace darkbox
