#include "processing/transfer/preview.h"

#include "processing/transfer/normal_table.h"
#include "processing/transfer/seed.h"

namespace darkbox {

cv::Mat2i preview(const MapLevel& source, const MapLevel& target, const TransferOptions& options) {
    const MapPyramid sources = map_pyramid(source, 2);
    const MapPyramid targets = map_pyramid(target, 2);
    const cv::Mat2i seeds = seed_coordinates(sources[1], NormalTable(sources[1]), targets[1], seed_options(options));
    return refined_coordinates(seeds, source.valid, target.valid);
}

}  // namespace darkbox
