#include "processing/normals/least_squares.h"

#include <sys/mman.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cstdint>
#include <initializer_list>
#include <numeric>
#include <optional>
#include <utility>
#include <vector>

#include "processing/maps/photo_pixel.h"
#include "processing/normals/least_squares_block.h"

namespace darkbox {
namespace {

/// Leaving clipped samples out may make the lights' geometry this much worse conditioned; beyond it, the rest does not
/// tell the normal.
constexpr double max_condition_growth = 4.0;

/// Where in a band a block lies.
struct Place {
    int row = 0;  ///< in the band
    int column = 0;
};

/// Returns whether anything of it lies on the object.
bool load_mask(const PhotoBand& band, Place place, LeastSquaresBlock& block) {
    if (band.mask.empty()) {
        block.mask.fill(1);
        return true;
    }
    const uchar* mask = band.mask[place.row] + place.column;
    std::copy_n(mask, block.count, block.mask.begin());
    return std::any_of(mask, mask + block.count, [](uchar m) { return m != 0; });
}

/// Returns the lights that have a clipped sample in the block.
std::vector<std::size_t> load_samples(const PhotoBand& band, const LightSet& set, Place place,
                                      LeastSquaresBlock& block) {
    std::vector<std::size_t> clipped;
    for (std::size_t k = 0; k < set.lights.size(); ++k) {
        const SolverLight& light = set.lights[k];
        if (load_photo(band.photos[light.image], place.row, place.column, light.gain, k, block)) clipped.push_back(k);
    }
    return clipped;
}

/// One pixel's samples of some lights.
class PartialPixel {
public:
    PartialPixel(const LightSet& set, const LeastSquaresBlock& block, std::size_t i, std::vector<std::size_t> lights)
        : set_(set), block_(block), i_(i), kept_(std::move(lights)) {}

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

    /// Neither the samples left nor the clipped ones tell this pixel's normal.
    void leave_out(LeastSquaresBlock& block) const { block.usable.at[i_] = 0.0F; }

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

/// The lights of one pixel that are not clipped, where `suspects` are those that may be.
std::vector<std::size_t> unclipped_lights(const PhotoBand& band, const LightSet& set, Place pixel,
                                          const std::vector<std::size_t>& suspects) {
    std::vector<std::size_t> kept(set.lights.size());
    std::iota(kept.begin(), kept.end(), std::size_t{0});
    const auto clipped = [&](std::size_t k) {
        return std::binary_search(suspects.begin(), suspects.end(), k) &&
               clipped_at(band.photos[set.lights[k].image], pixel.row, pixel.column);
    };
    std::erase_if(kept, clipped);
    return kept;
}

void leave_out_clipped(const PhotoBand& band, const LightSet& set, Place place,
                       const std::vector<std::size_t>& suspects, LeastSquaresBlock& block) {
    for (std::size_t i = 0; i < static_cast<std::size_t>(block.count); ++i) {
        if (block.usable.at[i] == 0.0F) continue;
        const Place here{place.row, place.column + static_cast<int>(i)};
        const bool clipped = std::any_of(suspects.begin(), suspects.end(), [&](std::size_t k) {
            return clipped_at(band.photos[set.lights[k].image], here.row, here.column);
        });
        if (!clipped) continue;
        const PartialPixel pixel(set, block, i, unclipped_lights(band, set, here, suspects));
        if (const auto g = pixel.solve())
            pixel.put(*g, block);
        else
            pixel.leave_out(block);
    }
}

/// Returns how many pixels of the object are not finite.
std::size_t sum_loaded_samples(const PhotoBand& band, const LightSet& set, Place place, LeastSquaresBlock& block) {
    const std::vector<std::size_t> clipped = load_samples(band, set, place, block);
    const std::size_t not_finite = project(set, block);
    accumulate_albedo(set, block);
    if (!clipped.empty()) leave_out_clipped(band, set, place, clipped, block);
    return not_finite;
}

void write_nothing(Place place, int row, int count, SolvedMaps& maps) {
    const int c = place.column;
    std::fill_n(maps.normal[row] + c, count, cv::Vec3f::all(0));
    std::fill_n(maps.albedo[row] + c, count, cv::Vec3f::all(0));
    std::fill_n(maps.residual[row] + c, count, 0.0F);
    std::fill_n(maps.valid[row] + c, count, uchar{0});
    std::fill_n(maps.lights_used[row] + c, count, ushort{0});
}

/// The first writing of a map costs a page fault for every page: half of the solver's time with small ones. A wish that
/// the system may not grant.
void prefer_large_pages(const cv::Mat& map) {
    constexpr std::uintptr_t page = 4096;
    const auto first = (reinterpret_cast<std::uintptr_t>(map.datastart) + page - 1) / page * page;
    const auto last = reinterpret_cast<std::uintptr_t>(map.dataend) / page * page;
    if (first < last) ::madvise(reinterpret_cast<void*>(first), last - first, MADV_HUGEPAGE);
}

}  // namespace

SolvedMaps::SolvedMaps(cv::Size size)
    : normal(size), albedo(size), valid(size), residual(size), lights_used(size), sigma_deg(size) {
    for (const cv::Mat* map :
         std::initializer_list<const cv::Mat*>{&normal, &albedo, &valid, &residual, &lights_used, &sigma_deg})
        prefer_large_pages(*map);
}

std::size_t SolvedMaps::bytes_per_pixel() {
    return 2 * sizeof(cv::Vec3f) + sizeof(uchar) + 2 * sizeof(float) + sizeof(ushort);
}

std::size_t solve_row_least_squares(const PhotoBand& band, const LightSet& set, float min_albedo, int row,
                                    SolvedMaps& maps) {
    std::size_t not_finite = 0;
    const int map_row = band.first_row + row;
    LeastSquaresBlock block(set.lights.size());
    for (Place place{row, 0}; place.column < band.cols(); place.column += block_pixels) {
        const int c = place.column;
        block.count = std::min(block_pixels, band.cols() - c);
        if (!load_mask(band, place, block)) {
            write_nothing(place, map_row, block.count, maps);
            continue;
        }
        block.samples_used.at.fill(static_cast<float>(set.lights.size()));
        if (const auto plain = sum_plain_samples(band, set, row, c, block))
            not_finite += *plain;
        else
            not_finite += sum_loaded_samples(band, set, place, block);
        finish(min_albedo, block,
               {maps.normal[map_row][c].val, maps.albedo[map_row][c].val, maps.residual[map_row] + c,
                maps.valid[map_row] + c, maps.lights_used[map_row] + c});
    }
    return not_finite;
}

}  // namespace darkbox
