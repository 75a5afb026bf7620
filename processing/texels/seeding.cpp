#include "processing/texels/seeding.h"

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>
#include <vector>

#include "processing/texels/blocks.h"
#include "processing/texels/candidates.h"
#include "processing/texels/random.h"

namespace darkbox {
namespace {

cv::Mat1f rows_at(const cv::Mat1f& points, const std::vector<int>& rows) {
    cv::Mat1f chosen(static_cast<int>(rows.size()), points.cols);
    for (int i = 0; i < chosen.rows; ++i) points.row(rows[i]).copyTo(chosen.row(i));
    return chosen;
}

class Seeding {
public:
    Seeding(const cv::Mat1f& points, std::uint64_t seed)
        : points_(points),
          blocks_(points.rows, 64),
          random_(seed),
          distance_(points.rows, std::numeric_limits<float>::infinity()),
          measured_(points.rows),
          potential_(blocks_.count(), 0.0) {}

    cv::Mat1f centres(int clusters) {
        std::vector<int> chosen{static_cast<int>(random_.uniform() * points_.rows)};
        measure(std::vector<int>(Candidates::lanes, chosen.front()));
        approach(0);
        while (static_cast<int>(chosen.size()) < clusters) {
            const double total = std::accumulate(potential_.begin(), potential_.end(), 0.0);
            if (!(total > 0)) break;  // every point lies on a centre already
            // Eight candidates are measured in the time of one.
            std::vector<int> candidates(Candidates::lanes);
            for (int& candidate : candidates) candidate = draw(total);
            const std::vector<double> after = measure(candidates);
            const auto best = static_cast<int>(std::min_element(after.begin(), after.end()) - after.begin());
            chosen.push_back(candidates[best]);
            approach(best);
        }
        return rows_at(points_, chosen);
    }

private:
    /// Distances of all points to each candidate, and what the potential would become with it as a centre.
    std::vector<double> measure(const std::vector<int>& candidates) {
        const Candidates together(rows_at(points_, candidates));
        std::vector<std::array<double, Candidates::lanes>> partial(blocks_.count());
        blocks_.for_each([&](int block) {
            std::array<double, Candidates::lanes> sum{};
            for (int i = blocks_.begin(block); i < blocks_.end(block); ++i) {
                measured_[i] = together.distances(points_[i]);
                for (int lane = 0; lane < Candidates::lanes; ++lane)
                    sum[lane] += std::min(distance_[i], measured_[i][lane]);
            }
            partial[block] = sum;
        });
        std::vector<double> potentials(candidates.size(), 0.0);
        for (const auto& sum : partial)
            for (std::size_t lane = 0; lane < candidates.size(); ++lane) potentials[lane] += sum[lane];
        return potentials;
    }

    /// Lowers every point's distance to that of its nearest centre, now that the measured candidate is one.
    void approach(int candidate) {
        blocks_.for_each([&](int block) {
            double sum = 0;
            for (int i = blocks_.begin(block); i < blocks_.end(block); ++i) {
                distance_[i] = std::min(distance_[i], measured_[i][candidate]);
                sum += distance_[i];
            }
            potential_[block] = sum;
        });
    }

    /// A point with probability proportional to its squared distance, never one at distance zero.
    int draw(double total) {
        double left = random_.uniform() * total;
        int block = 0;
        while (block + 1 < blocks_.count() && left >= potential_[block]) left -= potential_[block++];
        int drawn = -1;
        for (int i = blocks_.begin(block); i < blocks_.end(block); ++i) {
            if (!(distance_[i] > 0)) continue;
            drawn = i;
            left -= distance_[i];
            if (left < 0) break;
        }
        return drawn >= 0 ? drawn : farthest();
    }

    int farthest() const {
        return static_cast<int>(std::max_element(distance_.begin(), distance_.end()) - distance_.begin());
    }

    const cv::Mat1f& points_;
    Blocks blocks_;
    SplitMix64 random_;
    std::vector<float> distance_;                  ///< squared, of each point to its nearest centre
    std::vector<Candidates::Distances> measured_;  ///< to the candidates
    std::vector<double> potential_;                ///< sum of distances in each block
};

}  // namespace

cv::Mat1f seed_centres(const cv::Mat1f& points, int clusters, std::uint64_t seed) {
    return Seeding(points, seed).centres(clusters);
}

}  // namespace darkbox
