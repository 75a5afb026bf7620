#include "processing/normals/least_squares.h"

#include <Eigen/Dense>
#include <algorithm>
#include <optional>

#include "processing/normals/least_squares_block.h"

namespace darkbox {
namespace {

/// Leaving clipped samples out may make the lights' geometry this much worse conditioned; beyond it, noise would hurt
/// more than clipping does.
constexpr double max_condition_growth = 4.0;

/// Where in a band a block lies.
struct Place {
    int row = 0;  ///< in the band
    int column = 0;
};

bool on_object(const PhotoBand& band, Place place, std::size_t i) {
    return band.mask.empty() || band.mask(place.row, place.column + static_cast<int>(i)) != 0;
}

bool empty_of_object(const PhotoBand& band, Place place, int count) {
    if (band.mask.empty()) return false;
    const uchar* mask = band.mask[place.row] + place.column;
    return std::all_of(mask, mask + count, [](uchar m) { return m == 0; });
}

void load(const PhotoBand& band, const LightSet& set, Place place, LeastSquaresBlock& block) {
    block.clipped.at.fill(0.0F);
    for (std::size_t k = 0; k < set.lights.size(); ++k) {
        const SolverLight& light = set.lights[k];
        load_photo(band.photos[light.image], place.row, place.column, light.gain, k, block);
    }
    block.samples_used.at.fill(static_cast<float>(set.lights.size()));
}

/// A sample that is not finite leaves its trace in g; it is looked for before clipped samples are dropped, so that such
/// a pixel is never half used. Returns the number of such pixels on the object.
std::size_t find_usable(const PhotoBand& band, Place place, LeastSquaresBlock& block) {
    std::size_t not_finite = 0;
    for (std::size_t i = 0; i < static_cast<std::size_t>(block.count); ++i) {
        const float trace = block.g[0].at[i] * 0.0F + block.g[1].at[i] * 0.0F + block.g[2].at[i] * 0.0F;
        const bool finite = trace == 0.0F, inside = on_object(band, place, i);
        block.usable.at[i] = finite && inside ? 1.0F : 0.0F;
        not_finite += inside && !finite ? 1 : 0;
    }
    return not_finite;
}

/// One pixel's samples that are not clipped.
class UnclippedPixel {
public:
    UnclippedPixel(const PhotoBand& band, const LightSet& set, Place place, const LeastSquaresBlock& block,
                   std::size_t i)
        : set_(set), block_(block), i_(i) {
        for (std::size_t k = 0; k < set.lights.size(); ++k)
            if (!clipped_at(band.photos[set.lights[k].image], place.row, place.column + static_cast<int>(i)))
                kept_.push_back(k);
    }

    std::size_t samples() const { return kept_.size(); }

    /// g of these samples alone; no value where they do not determine it well.
    std::optional<Eigen::Vector3f> solve() const {
        Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
        Eigen::Vector3d projected = Eigen::Vector3d::Zero();
        for (const std::size_t k : kept_) {
            const Eigen::Vector3d direction = set_.lights[k].direction.cast<double>();
            moments += direction * direction.transpose();
            projected += direction * static_cast<double>(mean(k));
        }
        if (kept_.size() < 3) return std::nullopt;
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen;
        eigen.computeDirect(moments, Eigen::EigenvaluesOnly);
        const double limit = max_condition_growth * set_.condition_number;
        if (!(eigen.eigenvalues()[2] <= limit * limit * eigen.eigenvalues()[0])) return std::nullopt;
        return (moments.inverse() * projected).cast<float>();
    }

    /// Puts `g` and the sums that follow from it in place of those over all lights.
    void put(const Eigen::Vector3f& g, LeastSquaresBlock& block) const {
        Eigen::Array3f colour = Eigen::Array3f::Zero();
        float lit_weight = 0, squared = 0;
        for (const std::size_t k : kept_) {
            const float shading = g.dot(set_.lights[k].direction), lit = std::max(shading, 0.0F);
            const float error = mean(k) - shading;
            colour += lit * Eigen::Array3f(block_.value(k, 0, i_), block_.value(k, 1, i_), block_.value(k, 2, i_));
            lit_weight += lit * lit;
            squared += error * error;
        }
        for (int c = 0; c < 3; ++c) {
            block.g[static_cast<std::size_t>(c)].at[i_] = g[c];
            block.colour[static_cast<std::size_t>(c)].at[i_] = colour[c];
        }
        block.lit_weight.at[i_] = lit_weight;
        block.squared.at[i_] = squared;
        block.samples_used.at[i_] = static_cast<float>(kept_.size());
    }

private:
    float mean(std::size_t k) const {
        return (block_.value(k, 0, i_) + block_.value(k, 1, i_) + block_.value(k, 2, i_)) * (1.0F / 3.0F);
    }

    const LightSet& set_;
    const LeastSquaresBlock& block_;
    std::size_t i_;
    std::vector<std::size_t> kept_;
};

void leave_out_clipped(const PhotoBand& band, const LightSet& set, Place place, LeastSquaresBlock& block) {
    for (std::size_t i = 0; i < static_cast<std::size_t>(block.count); ++i) {
        if (block.clipped.at[i] == 0.0F || block.usable.at[i] == 0.0F) continue;
        const UnclippedPixel pixel(band, set, place, block, i);
        if (const auto g = pixel.solve()) pixel.put(*g, block);
    }
}

void write_flags(const LeastSquaresBlock& block, uchar* valid, ushort* lights_used) {
    for (std::size_t i = 0; i < static_cast<std::size_t>(block.count); ++i) {
        const bool is_valid = block.usable.at[i] > 0.0F;
        valid[i] = is_valid ? 255 : 0;
        lights_used[i] = is_valid ? static_cast<ushort>(block.samples_used.at[i]) : ushort{0};
    }
}

void write_nothing(Place place, int row, int count, SolvedMaps& maps) {
    const int c = place.column;
    std::fill_n(maps.normal[row] + c, count, cv::Vec3f::all(0));
    std::fill_n(maps.albedo[row] + c, count, cv::Vec3f::all(0));
    std::fill_n(maps.residual[row] + c, count, 0.0F);
    std::fill_n(maps.valid[row] + c, count, uchar{0});
    std::fill_n(maps.lights_used[row] + c, count, ushort{0});
}

}  // namespace

SolvedMaps::SolvedMaps(cv::Size size) : normal(size), albedo(size), valid(size), residual(size), lights_used(size) {}

std::size_t SolvedMaps::bytes_per_pixel() {
    return 2 * sizeof(cv::Vec3f) + sizeof(uchar) + sizeof(float) + sizeof(ushort);
}

std::size_t solve_row_least_squares(const PhotoBand& band, const LightSet& set, float min_albedo, int row,
                                    SolvedMaps& maps) {
    std::size_t not_finite = 0;
    const int map_row = band.first_row + row;
    LeastSquaresBlock block(set.lights.size());
    for (Place place{row, 0}; place.column < band.cols(); place.column += block_pixels) {
        const int c = place.column;
        block.count = std::min(block_pixels, band.cols() - c);
        if (empty_of_object(band, place, block.count)) {
            write_nothing(place, map_row, block.count, maps);
            continue;
        }
        load(band, set, place, block);
        project(set, block);
        not_finite += find_usable(band, place, block);
        accumulate_albedo(set, block);
        leave_out_clipped(band, set, place, block);
        finish(min_albedo, block,
               {maps.normal[map_row][c].val, maps.albedo[map_row][c].val, maps.residual[map_row] + c});
        write_flags(block, maps.valid[map_row] + c, maps.lights_used[map_row] + c);
    }
    return not_finite;
}

}  // namespace darkbox
