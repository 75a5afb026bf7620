#include "processing/transfer/patchmatch.h"

#include <algorithm>

#include "processing/transfer/normal_table.h"
#include "processing/transfer/refinement.h"
#include "processing/transfer/seed.h"

namespace darkbox {
namespace {

constexpr int default_levels = 3;

}  // namespace

int patchmatch_levels(int asked, cv::Size source, cv::Size target) {
    return asked > 0 ? asked : std::min(default_levels, pyramid_levels(0, source, target));
}

cv::Mat2i patchmatch(const GuidedPyramid& source, const GuidedPyramid& target, const TexelCode& code,
                     const TransferOptions& options, const PassesDone& passes_done) {
    const int levels = static_cast<int>(source.maps.size());
    RefinementPlan plan;
    if (options.passes) plan.passes = *options.passes;
    int done = 0;
    const auto pass_done = [&] { passes_done(++done, levels * plan.passes); };
    cv::Mat2i coordinates;
    for (int level = levels - 1; level >= 0; --level) {
        const MapLevel& from = source.maps[level];
        const MapLevel& onto = target.maps[level];
        const NormalTable table(from);
        coordinates = level == levels - 1 ? seed_coordinates(from, table, onto, seed_options(options))
                                          : refined_coordinates(coordinates, from.valid, onto.valid);
        coordinates = refine_level({from, onto, table, source.control_at(level), target.control_at(level), level},
                                   coordinates, plan, code, options, pass_done);
    }
    return coordinates;
}

}  // namespace darkbox
