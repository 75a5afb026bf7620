#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <opencv2/core.hpp>
#include <vector>

#include "processing/transfer/features.h"
#include "processing/transfer/nearest.h"

namespace darkbox {

/// The coordinate given to pixels outside the target, and to what was not found.
constexpr int nowhere = -1;

/// A source pixel and how far its feature is from a target's, squared.
struct Candidate {
    cv::Point source{nowhere, nowhere};
    float distance = std::numeric_limits<float>::infinity();
};

/// Image Analogies' global match: the source pixel of one level whose feature is nearest to a target's. Either by a
/// short list from NearestFeatures, ranked by the exact distance; or exact, by reading every source feature in full,
/// nothing left out: what the first is measured against. The exact search keeps all features, 4 bytes a number (110
/// for the default windows), and a query reads all of them.
///
/// Refers to the level's maps and the space. Immutable after construction, thus thread-safe.
class SourceSearch {
public:
    /// Memory that queries of one thread use again.
    struct Scratch {
        Feature source;
        std::vector<float> query;
        std::vector<Match> matches;
    };

    /// `coarse` is null at the coarsest level; `seed` is of what the short lists are learned from.
    SourceSearch(const MapLevel& source, const MapLevel* coarse, const FeatureSpace& space, bool exact,
                 std::uint64_t seed);

    /// Only pixels nearer than `radius` matter to the caller: farther ones may be found or not. Of pixels at the same
    /// distance the exact search takes the first in scan-line order.
    Candidate nearest(const Feature& target, float radius, Scratch& scratch) const;
    float distance_to(cv::Point source, const Feature& target, Scratch& scratch) const;

private:
    const MapLevel& level_;
    const MapLevel* coarse_;
    const FeatureSpace& space_;
    std::vector<cv::Point> sources_;
    std::vector<float> features_;                         ///< one after the other; empty unless exact
    std::unique_ptr<const NearestFeatures> short_lists_;  ///< null when exact

    void read(std::size_t i, Feature& feature) const { space_.read_source(level_, coarse_, sources_[i], feature); }
    void keep_features();
    Candidate among_all(const Feature& target) const;
    Candidate among_short_list(const Feature& target, float radius, Scratch& scratch) const;
};

}  // namespace darkbox
