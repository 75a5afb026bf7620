#include "processing/transfer/features.h"

#include <cmath>
#include <cstddef>

namespace darkbox {
namespace {

/// Distances add up in as many lanes, so that the compiler may use vectors and yet keep the order of the sum.
constexpr std::size_t lanes = 8;

bool is_causal(cv::Point offset) { return offset.y < 0 || (offset.y == 0 && offset.x < 0); }

float gaussian(cv::Point offset, int side) {
    const float sigma = static_cast<float>(side) / 3;
    return std::exp(-static_cast<float>(offset.dot(offset)) / (2 * sigma * sigma));
}

std::vector<cv::Point> square_offsets(int side) {
    std::vector<cv::Point> offsets;
    for (int dy = -(side / 2); dy <= side / 2; ++dy)
        for (int dx = -(side / 2); dx <= side / 2; ++dx) offsets.emplace_back(dx, dy);
    return offsets;
}

/// A squared distance of differences scaled by these counts each offset by its share of the Gaussian.
std::vector<float> scales(const std::vector<cv::Point>& offsets, int side) {
    float sum = 0;
    for (const cv::Point& offset : offsets) sum += gaussian(offset, side);
    std::vector<float> scale;
    for (const cv::Point& offset : offsets) scale.push_back(std::sqrt(gaussian(offset, side) / sum));
    return scale;
}

}  // namespace

/// Writes a feature's numbers one after the other.
class FeatureSpace::Writer {
public:
    explicit Writer(Feature& feature) : feature_(feature) {
        feature_.value.clear();
        feature_.known.clear();
        feature_.complete = true;
    }

    void add(const cv::Vec3f& v, float scale, float known = 1) {
        for (int c = 0; c < 3; ++c) {
            feature_.value.push_back(v[c] * scale);
            feature_.known.push_back(known);
        }
    }

    void add_unknown(const cv::Vec3f& stand_in, float scale) {
        add(stand_in, scale, 0);
        feature_.complete = false;
    }

    void pad() {
        while (feature_.value.size() % lanes != 0) {
            feature_.value.push_back(0);
            feature_.known.push_back(0);
        }
    }

private:
    Feature& feature_;
};

float squared_distance(const Feature& target, const float* source) {
    float sums[lanes] = {};
    const float* a = target.value.data();
    const float* known = target.known.data();
    for (std::size_t i = 0; i < target.value.size(); i += lanes)
        for (std::size_t lane = 0; lane < lanes; ++lane) {
            const float difference = a[i + lane] - source[i + lane];
            sums[lane] += known[i + lane] * difference * difference;
        }
    float sum = 0;
    for (const float s : sums) sum += s;
    return sum;
}

FeatureSpace::FeatureSpace(const TransferOptions& options, float white, cv::Vec3f mean_albedo)
    : mean_albedo_(mean_albedo) {
    const float normal_scale = 0.5F * std::sqrt(static_cast<float>(options.normal_weight));
    const float albedo_scale = 1 / white;
    const auto neighbours = [&](const std::vector<cv::Point>& offsets, int side) {
        std::vector<Neighbour> result;
        const std::vector<float> scale = scales(offsets, side);
        for (std::size_t i = 0; i < offsets.size(); ++i)
            result.push_back({offsets[i], scale[i] * normal_scale, scale[i] * albedo_scale});
        return result;
    };
    const std::vector<cv::Point> window = square_offsets(options.window);
    for (const cv::Point& offset : window)
        if (is_causal(offset)) causal_offsets_.push_back(offset);
    window_ = neighbours(window, options.window);
    causal_ = neighbours(causal_offsets_, options.window);
    coarse_ = neighbours(square_offsets(options.coarse_window), options.coarse_window);
}

void FeatureSpace::read_normals(const MapLevel& fine, cv::Point p, Writer& writer) const {
    for (const Neighbour& n : window_)
        writer.add(fine.normal(fine.has(p + n.offset) ? p + n.offset : p), n.normal_scale);
}

/// Both maps are known all over the coarser level, so its centre can stand for what is not valid.
void FeatureSpace::read_coarse(const MapLevel* coarse, cv::Point p, Writer& writer) const {
    if (coarse == nullptr) return;
    const cv::Point parent(p.x / 2, p.y / 2);
    for (const Neighbour& n : coarse_) {
        const cv::Point q = coarse->has(parent + n.offset) ? parent + n.offset : parent;
        writer.add(coarse->normal(q), n.normal_scale);
        writer.add(coarse->albedo(q), n.albedo_scale);
    }
}

void FeatureSpace::read_source(const MapLevel& fine, const MapLevel* coarse, cv::Point p, Feature& feature) const {
    Writer writer(feature);
    read_normals(fine, p, writer);
    for (const Neighbour& n : causal_)
        writer.add(fine.albedo(fine.has(p + n.offset) ? p + n.offset : p), n.albedo_scale);
    read_coarse(coarse, p, writer);
    writer.pad();
}

void FeatureSpace::read_target(const MapLevel& fine, const MapLevel* coarse, cv::Point p, Feature& feature) const {
    Writer writer(feature);
    read_normals(fine, p, writer);
    for (const Neighbour& n : causal_)
        if (fine.has(p + n.offset))
            writer.add(fine.albedo(p + n.offset), n.albedo_scale);
        else
            writer.add_unknown(mean_albedo_, n.albedo_scale);
    read_coarse(coarse, p, writer);
    writer.pad();
}

}  // namespace darkbox
