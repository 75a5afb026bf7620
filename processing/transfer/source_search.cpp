#include "processing/transfer/source_search.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>

namespace darkbox {
namespace {

std::vector<cv::Point> valid_pixels(const cv::Mat1b& valid) {
    std::vector<cv::Point> pixels;
    for (int y = 0; y < valid.rows; ++y)
        for (int x = 0; x < valid.cols; ++x)
            if (valid(y, x)) pixels.emplace_back(x, y);
    return pixels;
}

}  // namespace

SourceSearch::SourceSearch(const MapLevel& source, const MapLevel* coarse, const FeatureSpace& space, bool exact,
                           std::uint64_t seed)
    : level_(source), coarse_(coarse), space_(space), sources_(valid_pixels(source.valid)) {
    if (exact)
        keep_features();
    else
        short_lists_ = std::make_unique<const NearestFeatures>(
            sources_.size(), [this](std::size_t i, Feature& feature) { read(i, feature); }, seed);
}

void SourceSearch::keep_features() {
    Feature first;
    read(0, first);
    const std::size_t length = first.value.size();
    features_.resize(sources_.size() * length);
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, sources_.size()), [&](const auto& range) {
        Feature feature;
        for (std::size_t i = range.begin(); i < range.end(); ++i) {
            read(i, feature);
            std::copy(feature.value.begin(), feature.value.end(), features_.data() + i * length);
        }
    });
}

Candidate SourceSearch::nearest(const Feature& target, float radius, Scratch& scratch) const {
    return short_lists_ ? among_short_list(target, radius, scratch) : among_all(target);
}

float SourceSearch::distance_to(cv::Point source, const Feature& target, Scratch& scratch) const {
    space_.read_source(level_, coarse_, source, scratch.source);
    return squared_distance(target, scratch.source.value.data());
}

Candidate SourceSearch::among_all(const Feature& target) const {
    const std::size_t length = target.value.size();
    Candidate best;
    for (std::size_t i = 0; i < sources_.size(); ++i) {
        const float distance = squared_distance(target, features_.data() + i * length);
        if (distance < best.distance) best = {sources_[i], distance};
    }
    return best;
}

/// What is left out of an incomplete feature counts in the tree, so a radius would cut off too much there.
Candidate SourceSearch::among_short_list(const Feature& target, float radius, Scratch& scratch) const {
    const float limit = target.complete ? radius : std::numeric_limits<float>::infinity();
    short_lists_->short_list(target, limit, scratch.query, scratch.matches);
    Candidate best;
    for (const Match& match : scratch.matches) {
        const cv::Point source = sources_[static_cast<std::size_t>(match.point)];
        const float distance = distance_to(source, target, scratch);
        if (distance < best.distance) best = {source, distance};
    }
    return best;
}

}  // namespace darkbox
