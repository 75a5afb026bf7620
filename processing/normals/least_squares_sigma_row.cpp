#include <numbers>

#include "processing/normals/least_squares_sigma.h"
#include "processing/normals/predicted_sigma.h"

// Highway compiles this file once for each kind of processor.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "processing/normals/least_squares_sigma_row.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace darkbox {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// Degrees of freedom that the picture's variance counts for in each pixel.
constexpr float pooled_freedom = 6.0F;

/// Lanes(d) pixels from `column` on.
template <class D>
class SigmaPixels {
    using Vector = hn::Vec<D>;

public:
    SigmaPixels(D d, const SigmaPolynomial& polynomial, float picture_variance)
        : d_(d), polynomial_(polynomial), picture_variance_(picture_variance) {}

    void write(int row, int column, SolvedMaps& maps) const {
        Vector n[3], rgb[3];
        hn::LoadInterleaved3(d_, maps.normal[row][column].val, n[0], n[1], n[2]);
        hn::LoadInterleaved3(d_, maps.albedo[row][column].val, rgb[0], rgb[1], rgb[2]);
        const Vector albedo = hn::Mul(hn::Add(hn::Add(rgb[0], rgb[1]), rgb[2]), set(1.0F / 3.0F));
        const hn::Rebind<std::uint16_t, D> words;
        const Vector used =
            hn::ConvertTo(d_, hn::PromoteTo(hn::RebindToSigned<D>(), hn::LoadU(words, maps.lights_used[row] + column)));
        const Vector residual = hn::LoadU(d_, maps.residual[row] + column);

        const Vector freedom = hn::Add(hn::Sub(used, set(3.0F)), set(pooled_freedom));
        const Vector squares = hn::Mul(hn::Mul(residual, residual), used);
        const Vector variance = hn::Div(hn::Add(squares, set(pooled_freedom * picture_variance_)), freedom);
        const Vector tangential = hn::Max(tangential_variance(n, albedo, variance, freedom), hn::Zero(d_));
        const Vector all = hn::Div(set(polynomial_.lights), used);
        const Vector radians = hn::Div(hn::Sqrt(hn::Mul(hn::Mul(tangential, all), set(0.5F))), albedo);
        // Where nothing was solved, used and albedo are zero.
        const auto valid = hn::Gt(used, hn::Zero(d_));
        constexpr auto degrees = static_cast<float>(180.0 / std::numbers::pi);
        hn::StoreU(hn::IfThenElseZero(valid, hn::Mul(radians, set(degrees))), d_, maps.sigma_deg[row] + column);
    }

private:
    Vector set(float value) const { return hn::Set(d_, value); }

    /// The sum of a symmetric matrix's numbers by six factors.
    Vector sum(const SigmaPolynomial::Symmetric& numbers, const Vector* by) const {
        Vector total = hn::Mul(set(numbers[0]), by[0]);
        for (std::size_t i = 1; i < numbers.size(); ++i) total = hn::Add(total, hn::Mul(set(numbers[i]), by[i]));
        return total;
    }

    /// The variance of g across itself, both axes together: the trace of its covariance less that along the normal.
    Vector tangential_variance(const Vector* n, Vector albedo, Vector variance, Vector freedom) const {
        const Vector one = set(1.0F), twice = set(-2.0F);
        const Vector across[6] = {hn::Sub(one, hn::Mul(n[0], n[0])),   hn::Mul(twice, hn::Mul(n[0], n[1])),
                                  hn::Mul(twice, hn::Mul(n[0], n[2])), hn::Sub(one, hn::Mul(n[1], n[1])),
                                  hn::Mul(twice, hn::Mul(n[1], n[2])), hn::Sub(one, hn::Mul(n[2], n[2]))};
        Vector expected = set(polynomial_.mean_dark);
        Vector total = sum(polynomial_.dark, across);
        Vector g[3];
        for (std::size_t i = 0; i < 3; ++i) {
            g[i] = hn::Mul(n[i], albedo);
            expected = hn::Add(expected, hn::Mul(set(polynomial_.mean_shot[i]), g[i]));
            total = hn::Add(total, hn::Mul(sum(polynomial_.shot[i], across), g[i]));
        }
        if (polynomial_.lamps_known) {
            const Vector pairs[6] = {hn::Mul(g[0], g[0]), hn::Mul(g[0], g[1]), hn::Mul(g[0], g[2]),
                                     hn::Mul(g[1], g[1]), hn::Mul(g[1], g[2]), hn::Mul(g[2], g[2])};
            expected = hn::Add(expected, sum(polynomial_.mean_lamps, pairs));
            for (std::size_t i = 0; i < 6; ++i)
                total = hn::Add(total, hn::Mul(sum(polynomial_.lamps[i], across), pairs[i]));
        }
        expected = hn::Max(expected, hn::Zero(d_));
        const Vector by_chance =
            hn::Add(one, hn::Mul(set(chance_factor), hn::Sqrt(hn::Div(set(2.0F), hn::Max(freedom, one)))));
        const auto shown = hn::Gt(variance, hn::Mul(by_chance, expected));
        const Vector beyond = hn::IfThenElseZero(shown, hn::Sub(variance, expected));
        return hn::Add(total, hn::Mul(beyond, sum(polynomial_.inverse_moments, across)));
    }

    D d_;
    const SigmaPolynomial& polynomial_;
    float picture_variance_;
};

void write_sigma_row(const SigmaPolynomial& polynomial, float picture_variance, int row, SolvedMaps& maps) {
    const hn::ScalableTag<float> wide;
    const hn::CappedTag<float, 1> one;
    const auto lanes = static_cast<int>(hn::Lanes(wide));
    const SigmaPixels many(wide, polynomial, picture_variance);
    const SigmaPixels single(one, polynomial, picture_variance);
    int column = 0;
    for (; column + lanes <= maps.valid.cols; column += lanes) many.write(row, column, maps);
    for (; column < maps.valid.cols; ++column) single.write(row, column, maps);
}

}  // namespace HWY_NAMESPACE
}  // namespace darkbox
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace darkbox {

HWY_EXPORT(write_sigma_row);

void write_sigma_row(const SigmaPolynomial& polynomial, float picture_variance, int row, SolvedMaps& maps) {
    HWY_DYNAMIC_DISPATCH(write_sigma_row)(polynomial, picture_variance, row, maps);
}

}  // namespace darkbox
#endif
