#include "processing/transfer/synthesis.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <vector>

#include "processing/transfer/source_search.h"

namespace darkbox {
namespace {

/// Pixels of a row that one task synthesises. At least half a window, which a task needs of the next block above it.
constexpr int block_width = 16;

/// Memory that the pixels of one task use again.
struct Scratch {
    Feature target;
    std::vector<cv::Point> tried;
    SourceSearch::Scratch search;
};

class LevelSynthesis {
public:
    LevelSynthesis(const SynthesisLevel& level, const FeatureSpace& space, const GlobalMatch& global)
        : level_(level),
          space_(space),
          search_(level.source, level.coarse_source, space, global.exact, global.seed),
          coordinates_(level.target.valid.size(), cv::Vec2i(nowhere, nowhere)) {}

    void block(int y, int b) {
        Scratch scratch;
        const int end = std::min((b + 1) * block_width, coordinates_.cols);
        for (int x = b * block_width; x < end; ++x)
            if (level_.target.valid(y, x)) pixel({x, y}, scratch);
    }

    const cv::Mat2i& coordinates() const { return coordinates_; }

private:
    const SynthesisLevel& level_;
    const FeatureSpace& space_;
    SourceSearch search_;
    cv::Mat2i coordinates_;

    void pixel(cv::Point p, Scratch& scratch) {
        space_.read_target(level_.target, level_.coarse_target, p, scratch.target);
        const Candidate coherent = best_coherent(p, scratch);
        const auto tolerance = static_cast<float>(1 + level_.coherence);
        // Farther ones would lose against the coherent one.
        const Candidate anywhere = search_.nearest(scratch.target, coherent.distance / tolerance, scratch.search);
        const Candidate& best = coherent.distance <= anywhere.distance * tolerance ? coherent : anywhere;
        coordinates_(p) = cv::Vec2i(best.source.x, best.source.y);
        level_.target.albedo(p) = level_.source.albedo(best.source);
    }

    void consider(cv::Point source, Scratch& scratch, Candidate& best) const {
        if (!level_.source.has(source)) return;
        if (std::find(scratch.tried.begin(), scratch.tried.end(), source) != scratch.tried.end()) return;
        scratch.tried.push_back(source);
        const float distance = search_.distance_to(source, scratch.target, scratch.search);
        if (distance < best.distance) best = {source, distance};
    }

    /// What would continue the patches around p, and the patch of its parent.
    Candidate best_coherent(cv::Point p, Scratch& scratch) const {
        Candidate best;
        scratch.tried.clear();
        for (const cv::Point& offset : space_.causal_offsets())
            if (level_.target.has(p + offset)) consider(cv::Point(coordinates_(p + offset)) - offset, scratch, best);
        if (!level_.coarse_coordinates.empty()) {
            const cv::Point parent(level_.coarse_coordinates(p.y / 2, p.x / 2));
            consider(2 * parent + cv::Point(p.x % 2, p.y % 2), scratch, best);
        }
        return best;
    }
};

}  // namespace

// Block b of row y reads what is up to half a window away: to the right, no farther than block b + 1 of the rows above.
// So it may follow block b + 1 of row y - 1, and all blocks with the same 2 y + b are independent of each other.
cv::Mat2i synthesise_level(const SynthesisLevel& level, const FeatureSpace& space, const GlobalMatch& global,
                           const RowsDone& rows_done) {
    LevelSynthesis synthesis(level, space, global);
    const cv::Size size = level.target.valid.size();
    const int blocks = (size.width + block_width - 1) / block_width;
    const int last_step = 2 * (size.height - 1) + blocks - 1;
    for (int step = 0; step <= last_step; ++step) {
        const int first_row = std::max(0, (step - blocks + 2) / 2);
        const int last_row = std::min(size.height - 1, step / 2);
        tbb::parallel_for(first_row, last_row + 1, [&](int y) { synthesis.block(y, step - 2 * y); });
        rows_done(std::clamp((step - blocks + 3) / 2, 0, size.height));
    }
    return synthesis.coordinates();
}

}  // namespace darkbox
