#include "processing/transfer/preview.h"

#include <tbb/parallel_invoke.h>

#include <optional>

#include "processing/transfer/normal_table.h"
#include "processing/transfer/seed.h"

namespace darkbox {

cv::Mat2i preview(const MapLevel& source, const MapLevel& target, const TransferOptions& options) {
    MapPyramid sources, targets;
    std::optional<NormalTable> table;
    tbb::parallel_invoke(
        [&] {
            sources = map_pyramid(source, 2);
            table.emplace(sources[1]);
        },
        [&] { targets = map_pyramid(target, 2); });
    const cv::Mat2i seeds = seed_coordinates(sources[1], *table, targets[1], seed_options(options));
    return refined_coordinates(seeds, source.valid, target.valid);
}

}  // namespace darkbox
