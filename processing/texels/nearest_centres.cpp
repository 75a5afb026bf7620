#include "processing/texels/nearest_centres.h"

#include <algorithm>
#include <limits>

// Highway compiles this file once for each kind of processor.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "processing/texels/nearest_centres.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace darkbox {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// `points` points against blocks of `width` centres.
template <int width>
class Kernel {
    using Floats = hn::CappedTag<float, width>;
    using Vector = hn::Vec<Floats>;

public:
    static void find(const CentreTable& table, const float* points, std::size_t count, NearestCentres::Found* found) {
        // So many points at once that their sums fill the registers of the width at hand.
        const std::size_t vectors = width / hn::Lanes(Floats());
        std::size_t i = 0;
        const auto advance = [&]<int group, int parts>() {
            for (; i + group <= count; i += group)
                find_group<group, parts>(table, points + i * table.dimensions, found + i);
        };
        if (vectors == 1) advance.template operator()<8, 1>();
        if (vectors == 2) advance.template operator()<6, 2>();
        if (vectors == 4) advance.template operator()<2, 4>();
        if (vectors == 1) advance.template operator()<1, 1>();
        if (vectors == 2) advance.template operator()<1, 2>();
        if (vectors == 4) advance.template operator()<1, 4>();
        if (vectors > 4) advance.template operator()<1, width>();
    }

private:
    template <int group, int parts>
    static void find_group(const CentreTable& table, const float* points, NearestCentres::Found* found) {
        const Floats d;
        const std::size_t lanes = width / parts;
        constexpr float none = std::numeric_limits<float>::max();
        Vector best[group];
        Vector second[group];
        Vector part_of_best[group];
        for (int p = 0; p < group; ++p) {
            best[p] = second[p] = hn::Set(d, none);
            part_of_best[p] = hn::Zero(d);
        }
        const float* values = table.values;
        const float* bias = table.bias;
        for (int block = 0; block < table.blocks; ++block, bias += width) {
            Vector sum[group][parts];
            for (int p = 0; p < group; ++p)
                for (int v = 0; v < parts; ++v) sum[p][v] = hn::LoadU(d, bias + v * lanes);
            for (int dimension = 0; dimension < table.dimensions; ++dimension, values += width) {
                Vector centres[parts];
                for (int v = 0; v < parts; ++v) centres[v] = hn::LoadU(d, values + v * lanes);
                for (int p = 0; p < group; ++p) {
                    const Vector coordinate = hn::Set(d, points[p * table.dimensions + dimension]);
                    for (int v = 0; v < parts; ++v) sum[p][v] = hn::NegMulAdd(coordinate, centres[v], sum[p][v]);
                }
            }
            for (int p = 0; p < group; ++p)
                for (int v = 0; v < parts; ++v) {
                    const auto nearer = hn::Lt(sum[p][v], best[p]);
                    second[p] = hn::Min(second[p], hn::Max(sum[p][v], best[p]));
                    best[p] = hn::Min(best[p], sum[p][v]);
                    part_of_best[p] =
                        hn::IfThenElse(nearer, hn::Set(d, static_cast<float>(block * parts + v)), part_of_best[p]);
                }
        }
        const Vector lane = hn::Iota(d, 0.0F);
        for (int p = 0; p < group; ++p) {
            const float score = hn::GetLane(hn::MinOfLanes(d, best[p]));
            const Vector centre = hn::MulAdd(part_of_best[p], hn::Set(d, static_cast<float>(lanes)), lane);
            const Vector tied = hn::IfThenElse(hn::Eq(best[p], hn::Set(d, score)), centre, hn::Set(d, none));
            const float first = hn::GetLane(hn::MinOfLanes(d, tied));
            const Vector others = hn::IfThenElse(hn::Eq(tied, hn::Set(d, first)), second[p], best[p]);
            found[p] = {static_cast<int>(first), score, hn::GetLane(hn::MinOfLanes(d, others))};
        }
    }
};

void find_in_blocks_of_8(const CentreTable& table, const float* points, std::size_t count,
                         NearestCentres::Found* found) {
    Kernel<8>::find(table, points, count, found);
}
void find_in_blocks_of_16(const CentreTable& table, const float* points, std::size_t count,
                          NearestCentres::Found* found) {
    Kernel<16>::find(table, points, count, found);
}

}  // namespace HWY_NAMESPACE
}  // namespace darkbox
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace darkbox {

HWY_EXPORT(find_in_blocks_of_8);
HWY_EXPORT(find_in_blocks_of_16);

NearestCentres::NearestCentres(const cv::Mat1f& centres)
    : width_(centres.rows <= 8 ? 8 : 16),
      blocks_((centres.rows + width_ - 1) / width_),
      dimensions_(centres.cols),
      values_(static_cast<std::size_t>(blocks_) * dimensions_ * width_, 0.0F),
      bias_(static_cast<std::size_t>(blocks_) * width_, std::numeric_limits<float>::max()) {
    for (int c = 0; c < centres.rows; ++c) {
        const float* centre = centres[c];
        double squared = 0;
        for (int d = 0; d < dimensions_; ++d) {
            squared += static_cast<double>(centre[d]) * centre[d];
            values_[(static_cast<std::size_t>(c / width_) * dimensions_ + d) * width_ + c % width_] = centre[d];
        }
        bias_[c] = static_cast<float>(squared / 2);
    }
}

void NearestCentres::find(const float* points, std::size_t count, Found* found) const {
    const CentreTable table{values_.data(), bias_.data(), blocks_, dimensions_};
    if (width_ == 8)
        HWY_DYNAMIC_DISPATCH(find_in_blocks_of_8)(table, points, count, found);
    else
        HWY_DYNAMIC_DISPATCH(find_in_blocks_of_16)(table, points, count, found);
}

}  // namespace darkbox
#endif
