#include "processing/texels/kmeans.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>

#include "processing/texels/centre_blocks.h"
#include "processing/texels/random.h"

namespace darkbox {
namespace {

/// Points split at places that depend on their number alone, so that sums come out the same on any number of threads.
class Blocks {
public:
    explicit Blocks(int points)
        : points_(points),
          size_(std::max(smallest, (points + most - 1) / most)),
          count_((points + size_ - 1) / size_) {}

    int count() const { return count_; }
    int begin(int block) const { return block * size_; }
    int end(int block) const { return std::min(points_, begin(block) + size_); }

    template <class Body>
    void for_each(const Body& body) const {
        tbb::parallel_for(0, count_, body);
    }

private:
    static constexpr int smallest = 512;
    static constexpr int most = 64;  ///< bounds the memory of per-block sums

    int points_;
    int size_;
    int count_;
};

cv::Mat1f rows_at(const cv::Mat1f& points, const std::vector<int>& rows) {
    cv::Mat1f chosen(static_cast<int>(rows.size()), points.cols);
    for (int i = 0; i < chosen.rows; ++i) points.row(rows[i]).copyTo(chosen.row(i));
    return chosen;
}

/// Greedy k-means++.
class Seeding {
public:
    Seeding(const cv::Mat1f& points, const Blocks& blocks, std::uint64_t seed)
        : points_(points),
          blocks_(blocks),
          random_(seed),
          distance_(points.rows, std::numeric_limits<float>::infinity()),
          measured_(points.rows),
          potential_(blocks.count(), 0.0) {}

    cv::Mat1f centres(int clusters) {
        std::vector<int> chosen{static_cast<int>(random_.uniform() * points_.rows)};
        measure(chosen);
        approach(0);
        while (static_cast<int>(chosen.size()) < clusters) {
            const double total = std::accumulate(potential_.begin(), potential_.end(), 0.0);
            if (!(total > 0)) break;  // every point lies on a centre already
            // Eight candidates are measured in the time of one.
            std::vector<int> candidates(CentreBlocks::lanes);
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
        const CentreBlocks blocks_of_centres(rows_at(points_, candidates));
        std::vector<std::array<double, CentreBlocks::lanes>> partial(blocks_.count());
        blocks_.for_each([&](int block) {
            std::array<double, CentreBlocks::lanes> sum{};
            for (int i = blocks_.begin(block); i < blocks_.end(block); ++i) {
                measured_[i] = blocks_of_centres.distances(points_[i], 0);
                for (int lane = 0; lane < CentreBlocks::lanes; ++lane)
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
    const Blocks& blocks_;
    SplitMix64 random_;
    std::vector<float> distance_;                    ///< squared, of each point to its nearest centre
    std::vector<CentreBlocks::Distances> measured_;  ///< to the candidates
    std::vector<double> potential_;                  ///< sum of distances in each block
};

/// Points added up by cluster.
struct Sums {
    Sums(int clusters, int dimensions) : sum(cv::Mat1d::zeros(clusters, dimensions)), count(clusters, 0) {}

    void add(int cluster, const float* point) {
        double* row = sum[cluster];
        for (int d = 0; d < sum.cols; ++d) row[d] += point[d];
        ++count[cluster];
    }

    void move(int from, int to, const float* point) {
        for (int d = 0; d < sum.cols; ++d) sum(from, d) -= point[d];
        --count[from];
        add(to, point);
    }

    void add(const Sums& other) {
        sum += other.sum;
        for (std::size_t c = 0; c < count.size(); ++c) count[c] += other.count[c];
    }

    cv::Mat1d sum;
    std::vector<int> count;
};

class Lloyd {
public:
    Lloyd(const cv::Mat1f& points, const Blocks& blocks, cv::Mat1f centres)
        : points_(points),
          blocks_(blocks),
          centres_(std::move(centres)),
          label_(points.rows, -1),
          distance_(points.rows, 0.0F) {}

    KMeansResult run(int iterations) {
        int done = 0;
        bool changed = true;
        while (changed && done < iterations) {
            changed = iterate();
            ++done;
        }
        return {label_, centres_, inertia(), done};
    }

private:
    /// Whether any point changed its cluster.
    bool iterate() {
        const std::vector<int> before = label_;
        Sums sums = assign();
        revive(sums);
        if (label_ == before) return false;
        for (int c = 0; c < centres_.rows; ++c)
            for (int d = 0; d < centres_.cols; ++d) centres_(c, d) = static_cast<float>(sums.sum(c, d) / sums.count[c]);
        return true;
    }

    Sums assign() {
        const CentreBlocks measure(centres_);
        std::vector<Sums> partial(blocks_.count(), Sums(0, 0));
        blocks_.for_each([&](int block) {
            Sums sums(centres_.rows, centres_.cols);
            for (int i = blocks_.begin(block); i < blocks_.end(block); ++i) {
                const CentreBlocks::Nearest nearest = measure.nearest(points_[i]);
                label_[i] = nearest.centre;
                distance_[i] = nearest.squared_distance;
                sums.add(nearest.centre, points_[i]);
            }
            partial[block] = std::move(sums);
        });
        Sums total(centres_.rows, centres_.cols);
        for (const Sums& sums : partial) total.add(sums);
        return total;
    }

    /// The seeds differ from one another, so there is always a cluster of more than one point to take from.
    void revive(Sums& sums) {
        for (int dead = 0; dead < centres_.rows; ++dead) {
            if (sums.count[dead] > 0) continue;
            const int point = farthest_that_is_not_alone(sums);
            sums.move(label_[point], dead, points_[point]);
            label_[point] = dead;
            distance_[point] = 0;
        }
    }

    int farthest_that_is_not_alone(const Sums& sums) const {
        int farthest = -1;
        for (int i = 0; i < points_.rows; ++i)
            if (sums.count[label_[i]] > 1 && (farthest < 0 || distance_[i] > distance_[farthest])) farthest = i;
        return farthest;
    }

    double inertia() const {
        std::vector<double> partial(blocks_.count(), 0.0);
        blocks_.for_each([&](int block) {
            for (int i = blocks_.begin(block); i < blocks_.end(block); ++i)
                partial[block] += squared_distance(points_[i], centres_[label_[i]]);
        });
        return std::accumulate(partial.begin(), partial.end(), 0.0);
    }

    double squared_distance(const float* a, const float* b) const {
        double sum = 0;
        for (int d = 0; d < points_.cols; ++d) {
            const double difference = static_cast<double>(a[d]) - b[d];
            sum += difference * difference;
        }
        return sum;
    }

    const cv::Mat1f& points_;
    const Blocks& blocks_;
    cv::Mat1f centres_;
    std::vector<int> label_;
    std::vector<float> distance_;  ///< squared, to the centre of the point's label
};

}  // namespace

KMeansResult kmeans(const cv::Mat1f& points, const KMeansOptions& options) {
    const Blocks blocks(points.rows);
    cv::Mat1f seeds = Seeding(points, blocks, options.seed).centres(options.clusters);
    return Lloyd(points, blocks, std::move(seeds)).run(options.iterations);
}

}  // namespace darkbox
