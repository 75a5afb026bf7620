#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "processing/transfer/features.h"
#include "processing/transfer/kd_tree.h"

namespace darkbox {

/// Finds, among many long vectors, those nearest to another: their principal components are kept in a k-d tree, which
/// gives a short list for the caller to rank by the exact distance. A distance in the tree is never more than the exact
/// one. Immutable after construction, thus thread-safe; built on TBB's threads, equal on any number of them.
class NearestFeatures {
public:
    /// Writes vector i, of the one length that all have.
    using Reader = std::function<void(std::size_t i, Feature& feature)>;

    static constexpr std::size_t usual_components = 16;

    /// `count` is at least 1; `seed` picks the sample that the components are learned from. Fewer components take less
    /// memory, 8 bytes for each and vector, and tell less of what need not be compared.
    NearestFeatures(std::size_t count, const Reader& reader, std::uint64_t seed,
                    std::size_t components = usual_components);

    /// Those nearest in the tree and there nearer than `squared_radius`; `matches` and `query` are used again.
    void short_list(const Feature& feature, float squared_radius, std::vector<float>& query,
                    std::vector<Match>& matches) const;

    /// The nearest of all by the exact distance, which `distance` tells; `query` is used again. The feature is
    /// complete.
    Match nearest(const Feature& feature, const KdTree::Distance& distance, std::vector<float>& query) const;

private:
    Eigen::VectorXf mean_;
    Eigen::MatrixXf axes_;  ///< one column for each component
    std::unique_ptr<const KdTree> tree_;

    void learn_axes(std::size_t count, const Reader& reader, std::uint64_t seed, std::size_t components);
    void project(const Feature& feature, float* point) const;
};

}  // namespace darkbox
