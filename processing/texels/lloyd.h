#pragma once

#include <opencv2/core.hpp>
#include <span>
#include <vector>

#include "processing/texels/blocks.h"
#include "processing/texels/nearest_centres.h"
#include "processing/texels/points.h"

namespace darkbox {

/// Points added up by cluster.
struct ClusterSums {
    ClusterSums() = default;
    ClusterSums(int clusters, int dimensions) : sum(cv::Mat1d::zeros(clusters, dimensions)), count(clusters, 0) {}

    void add(int cluster, const float* point);
    void remove(int cluster, const float* point);
    void add(const ClusterSums& other);

    cv::Mat1d sum;
    std::vector<int> count;
};

/// Lloyd's algorithm from given centres, all different. Coordinates are taken about the centres' mean within.
class Lloyd {
public:
    Lloyd(const PointSource& points, const cv::Mat1f& centres);

    /// Assigns all points and moves the centres; whether any point changed its cluster.
    bool iterate();

    cv::Mat1f centres() const;
    const std::vector<int>& labels() const { return label_; }
    /// Sum of squared distances of the points to their centres.
    double inertia() const;

private:
    /// What is known of a point's distances since they were measured last.
    struct Bounds {
        float upper;  ///< to its own centre, at most
        float lower;  ///< to every other centre, at least
    };
    /// How far the centres went in the last iteration.
    struct Drift {
        std::vector<float> of;  ///< each centre
        int farthest = 0;       ///< the centre that went farthest
        float second = 0;       ///< how far any other went
    };

    ClusterSums assign_block(int block, const NearestCentres& nearest);
    void assign(std::span<const int> points, const NearestCentres& nearest, float* coordinates, ClusterSums& change);
    bool stays(int point);
    bool revive();
    int farthest_that_is_not_alone() const;
    void move_centres();
    void measure_drift(const cv::Mat1f& before);
    void measure_gaps();
    void read(std::span<const int> points, float* to) const;

    const PointSource& points_;
    Blocks blocks_;
    cv::Mat1f centres_;  ///< about mean_
    std::vector<float> mean_;
    std::vector<int> label_;             ///< -1 before the first iteration
    std::vector<float> squared_length_;  ///< of each point
    std::vector<Bounds> bounds_;
    ClusterSums sums_;
    Drift drift_;
    std::vector<float> half_gap_;  ///< half the distance from each centre to the nearest other one
    float squared_reach_ = 0;      ///< greatest squared length of a centre
};

}  // namespace darkbox
