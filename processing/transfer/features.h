#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "processing/transfer/pyramid.h"
#include "processing/transfer/transfer.h"

namespace darkbox {

/// What surrounds a pixel, as a point whose squared distance to another is the weighted difference of the surroundings.
struct Feature {
    std::vector<float> value;
    std::vector<float> known;  ///< 1, or 0 for what the target does not have: left out of the distance
    bool complete = true;      ///< nothing is left out
};

/// Squared distance from a target's feature to the numbers of a source's, over what the target has.
float squared_distance(const Feature& target, const float* source);

/// The feature vector of Image Analogies (Hertzmann et al. 2001, section 3.2): the window of normals around the pixel
/// and the causal window of albedo before it in scan-line order, and where there is a coarser level the full windows of
/// both around its parent. Each of the four windows is weighted by a Gaussian of sum 1; normals count half their
/// difference, as if encoded as RGB, and albedo in units of `white`.
///
/// Neighbours that are not valid: a normal is replaced by the centre's, in source and target alike. An albedo is
/// replaced by the centre's in the source; the target's centre is not known yet, so there it is left out of the
/// distance, and stands at `mean_albedo` for the search that cannot leave anything out.
///
/// Immutable after construction, thus thread-safe.
class FeatureSpace {
public:
    FeatureSpace(const TransferOptions& options, float white, cv::Vec3f mean_albedo);

    /// `coarse` is null at the coarsest level. The feature's memory is used again.
    void read_source(const MapLevel& fine, const MapLevel* coarse, cv::Point p, Feature& feature) const;
    void read_target(const MapLevel& fine, const MapLevel* coarse, cv::Point p, Feature& feature) const;

    /// Offsets to the pixels of the causal window.
    const std::vector<cv::Point>& causal_offsets() const { return causal_offsets_; }

private:
    struct Neighbour {
        cv::Point offset;
        float normal_scale;
        float albedo_scale;
    };

    class Writer;

    cv::Vec3f mean_albedo_;
    std::vector<Neighbour> window_;  ///< normals
    std::vector<Neighbour> causal_;  ///< albedo
    std::vector<Neighbour> coarse_;  ///< both
    std::vector<cv::Point> causal_offsets_;

    void read_normals(const MapLevel& fine, cv::Point p, Writer& writer) const;
    void read_coarse(const MapLevel* coarse, cv::Point p, Writer& writer) const;
};

}  // namespace darkbox
