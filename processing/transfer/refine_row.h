#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "processing/transfer/balance.h"
#include "processing/transfer/normal_table.h"
#include "processing/transfer/pyramid.h"
#include "processing/transfer/texel_bytes.h"

namespace darkbox {

/// What decides on the source coordinate of a pixel of one level. All of it stays as it is while pixels of one class
/// are refined.
struct Refinement {
    const MapLevel& source;
    const TexelBytes& source_bytes;
    const NormalTable& table;
    const cv::Mat1i& bin;  ///< the bin of each target pixel's normal
    const MapLevel& target;
    const TexelBytes& target_bytes;  ///< its albedo is the source's at the coordinates
    const cv::Mat1b& whole;          ///< target pixels whose window is valid all over
    const std::vector<int>& places;  ///< in the source, at each place of the target; nowhere() outside
    const TextureBalance& balance;
    int window;
    float vote_weight;     ///< of the colour that the neighbours' patches expect here, in pixels of a patch
    float cut;             ///< what it costs more for each of the four neighbours whose patch is not continued
    float incoherence;     ///< how many times the cost of a candidate that continues no neighbour counts
    std::uint64_t random;  ///< another for each pass
};

/// Sets the best source places of target pixels first, first + 2, ... of row y. Candidates: the present one, what
/// continues the patches of neighbours one and two pixels away (PatchMatch's propagation, Barnes et al. 2009, section
/// 3.2; k-coherence with k = 1), one with the pixel's own normal, and some in a shrinking random neighbourhood. A
/// candidate costs the squared difference of the patches, where the albedo of the centre, which is to be found, is the
/// mean of what the patches of the neighbours have there; once more that difference, since as many patches change with
/// it; the cuts that it makes; and what the balance adds.
void refine_row(const Refinement& refinement, int y, int first, int* refined);

}  // namespace darkbox
