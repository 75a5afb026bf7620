#include "processing/transfer/analogies.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "acquisition/frame/error.h"
#include "processing/transfer/features.h"
#include "processing/transfer/normal_table.h"
#include "processing/transfer/refinement.h"
#include "processing/transfer/seed.h"
#include "processing/transfer/synthesis.h"

namespace darkbox {
namespace {

/// A search in scan-line order does not know how often it took what: it takes passes to make up for that.
constexpr int default_passes = 16;
constexpr float colour_weight = 4;

/// The finest level that is synthesised where levels are refined; finer ones continue it: a causal search at full
/// resolution would undo what the coarser levels had balanced.
constexpr int synthesised_before_refining = 2;

cv::Vec3f mean_albedo(const MapLevel& level) {
    const cv::Scalar mean = cv::mean(level.albedo, level.valid);
    return {static_cast<float>(mean[0]), static_cast<float>(mean[1]), static_cast<float>(mean[2])};
}

void read_albedo(const MapLevel& source, const cv::Mat2i& coordinates, MapLevel& target) {
    for (int y = 0; y < coordinates.rows; ++y)
        for (int x = 0; x < coordinates.cols; ++x)
            if (target.valid(y, x)) target.albedo(y, x) = source.albedo(cv::Point(coordinates(y, x)));
}

/// Tells each finished row of each level once, all of a level at once where it is only refined, and stops the work when
/// that is asked for.
class Progress {
public:
    Progress(const WorkContext& work, const MapPyramid& target) : work_(work) {
        for (const MapLevel& level : target) total_ += level.valid.rows;
    }

    void begin_level() { before_ += std::exchange(rows_, 0); }

    void check() const {
        if (work_.cancelled()) throw Cancelled("texture transfer was cancelled", "start it again when you like");
    }

    void rows_done(int rows) {
        check();
        if (rows == rows_) return;
        rows_ = rows;
        work_.tell({"transfer", static_cast<std::size_t>(before_ + rows_), static_cast<std::size_t>(total_), {}});
    }

private:
    const WorkContext& work_;
    int total_ = 0;
    int before_ = 0;
    int rows_ = 0;
};

}  // namespace

cv::Mat2i analogies(const MapPyramid& source, MapPyramid target, float white, const TransferOptions& options,
                    const WorkContext& work) {
    const FeatureSpace space(options, white, mean_albedo(source.front()));
    const RefinementPlan plan{options.passes.value_or(default_passes), colour_weight};
    Progress progress(work, target);
    cv::Mat2i coordinates;
    const int coarsest = static_cast<int>(source.size()) - 1;
    for (int level = coarsest; level >= 0; --level) {
        progress.begin_level();
        const bool has_coarser = level < coarsest;
        if (plan.passes > 0 && level < std::min(coarsest, synthesised_before_refining)) {
            coordinates = refined_coordinates(coordinates, source[level].valid, target[level].valid);
        } else {
            coordinates = synthesise_level(
                {source[level], has_coarser ? &source[level + 1] : nullptr, target[level],
                 has_coarser ? &target[level + 1] : nullptr, coordinates, std::ldexp(options.kappa, -level)},
                space, {options.exact_search, options.seed}, [&](int rows) { progress.rows_done(rows); });
        }
        if (plan.passes == 0) continue;
        const NormalTable table(source[level]);
        coordinates = refine_level({source[level], target[level], table, nullptr, nullptr, level}, coordinates, plan,
                                   {white, options.normal_weight}, options, [&] { progress.check(); });
        read_albedo(source[level], coordinates, target[level]);
        progress.rows_done(coordinates.rows);
    }
    return coordinates;
}

}  // namespace darkbox
