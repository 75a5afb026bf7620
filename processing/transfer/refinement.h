#pragma once

#include <functional>
#include <opencv2/core.hpp>

#include "processing/transfer/normal_table.h"
#include "processing/transfer/pyramid.h"
#include "processing/transfer/texel_bytes.h"
#include "processing/transfer/transfer.h"

namespace darkbox {

/// One level of a transfer that is to be refined.
struct RefinementLevel {
    const MapLevel& source;
    const MapLevel& target;
    const NormalTable& table;        ///< of the source
    const MapLevel* source_control;  ///< the control maps as albedo; null: none
    const MapLevel* target_control;
    int level;  ///< how many times the maps were halved
};

/// How the level is refined.
struct RefinementPlan {
    int passes = 7;
    float colour_weight = 1;  ///< of the smooth colour that the normals let expect
};

/// Called after each pass; may throw to stop the work.
using PassDone = std::function<void()>;

/// Source coordinates of every valid target pixel, (-1, -1) elsewhere, better than the given ones: passes over all
/// pixels (refine_row.h) under a balance of what is used (balance.h). A pass goes through the four classes of pixels
/// that are even or odd in x and y; within a class all pixels look at the state before it, so they may be refined in
/// any order: the result does not depend on the number of TBB's threads. The last pass of the finest level closes
/// seams.
cv::Mat2i refine_level(const RefinementLevel& level, const cv::Mat2i& coordinates, const RefinementPlan& plan,
                       const TexelCode& code, const TransferOptions& options, const PassDone& pass_done);

}  // namespace darkbox
