#include "processing/transfer/nearest.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <Eigen/QR>
#include <algorithm>
#include <limits>

#include "processing/texels/random.h"

namespace darkbox {
namespace {

constexpr std::size_t short_list_length = 8;
constexpr int most_leaves = 64;
constexpr std::size_t training_size = 8192;
constexpr int subspace_rounds = 5;

Eigen::Map<const Eigen::VectorXf> as_vector(const Feature& feature) {
    return {feature.value.data(), static_cast<Eigen::Index>(feature.value.size())};
}

Eigen::MatrixXf sample_rows(std::size_t count, const NearestFeatures::Reader& reader, SplitMix64& random) {
    const std::size_t stride = (count + training_size - 1) / training_size;
    const std::size_t first = random.next() % stride;
    Feature feature;
    reader(first, feature);
    Eigen::MatrixXf rows((count - first + stride - 1) / stride, feature.value.size());
    for (Eigen::Index i = 0; i < rows.rows(); ++i) {
        reader(first + static_cast<std::size_t>(i) * stride, feature);
        rows.row(i) = as_vector(feature).transpose();
    }
    return rows;
}

}  // namespace

NearestFeatures::NearestFeatures(std::size_t count, const Reader& reader, std::uint64_t seed, std::size_t components) {
    learn_axes(count, reader, seed, components);
    PointSet points;
    points.dimensions = static_cast<std::size_t>(axes_.cols());
    points.coordinates.resize(count * points.dimensions);
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count), [&](const auto& range) {
        Feature feature;
        for (std::size_t i = range.begin(); i < range.end(); ++i) {
            reader(i, feature);
            project(feature, points.coordinates.data() + i * points.dimensions);
        }
    });
    tree_ = std::make_unique<const KdTree>(points);
}

/// Principal axes of every n-th vector, from one that the seed picks, by subspace iteration from a random start (Halko
/// et al. 2011): a few rounds give axes as good as a full decomposition, whose cost grows with the window's sixth
/// power.
void NearestFeatures::learn_axes(std::size_t count, const Reader& reader, std::uint64_t seed, std::size_t components) {
    SplitMix64 random(seed);
    const Eigen::MatrixXf rows = sample_rows(count, reader, random);
    mean_ = rows.colwise().mean().transpose();
    const Eigen::MatrixXf centred = rows.rowwise() - mean_.transpose();
    axes_.resize(rows.cols(), std::min<Eigen::Index>(static_cast<Eigen::Index>(components), rows.cols()));
    for (float& v : axes_.reshaped()) v = static_cast<float>(random.uniform() - 0.5);
    for (int round = 0; round < subspace_rounds; ++round) {
        const Eigen::MatrixXf spread = centred.transpose() * (centred * axes_);
        const Eigen::HouseholderQR<Eigen::MatrixXf> qr(spread);
        axes_ = qr.householderQ() * Eigen::MatrixXf::Identity(axes_.rows(), axes_.cols());
    }
}

void NearestFeatures::project(const Feature& feature, float* point) const {
    Eigen::Map<Eigen::VectorXf>(point, axes_.cols()).noalias() = axes_.transpose() * (as_vector(feature) - mean_);
}

void NearestFeatures::short_list(const Feature& feature, float squared_radius, std::vector<float>& query,
                                 std::vector<Match>& matches) const {
    query.resize(static_cast<std::size_t>(axes_.cols()));
    project(feature, query.data());
    tree_->nearest(query.data(), short_list_length, squared_radius, most_leaves, matches);
}

Match NearestFeatures::nearest(const Feature& feature, const KdTree::Distance& distance,
                               std::vector<float>& query) const {
    query.resize(static_cast<std::size_t>(axes_.cols()));
    project(feature, query.data());
    return tree_->nearest_by(distance, query.data(), std::numeric_limits<float>::infinity());
}

}  // namespace darkbox
