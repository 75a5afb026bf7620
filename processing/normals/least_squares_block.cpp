#include "processing/normals/least_squares_block.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

// Highway compiles this file once for each kind of processor.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "processing/normals/least_squares_block.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace darkbox {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using Floats = hn::ScalableTag<float>;
using Vector = hn::Vec<Floats>;

inline std::size_t lanes() { return hn::Lanes(Floats()); }

template <class Narrow>
Vector widened(Narrow samples) {
    return hn::ConvertTo(Floats(), hn::PromoteTo(hn::RebindToSigned<Floats>(), samples));
}
inline Vector widened(Vector samples) { return samples; }

inline float* at(Plane& plane, std::size_t i) { return plane.at.data() + i; }
inline Vector load(const Plane& plane, std::size_t i) { return hn::Load(Floats(), plane.at.data() + i); }
inline void store(Vector values, Plane& plane, std::size_t i) { hn::Store(values, Floats(), at(plane, i)); }

/// What load_photo() does with linear samples; `dark` is empty where a constant is subtracted.
template <class Sample>
void load_linear(const PhotoRows& rows, const Sample* samples, const float* dark, const std::array<float, 3>& gain,
                 Plane* rgb, LeastSquaresBlock& block) {
    const Floats d;
    const hn::Rebind<Sample, Floats> narrow;
    const auto count = static_cast<std::size_t>(block.count);
    const Vector scale = hn::Set(d, rows.scale), limit = hn::Set(d, rows.limit), one = hn::Set(d, 1.0F);
    const Vector gains[3] = {hn::Set(d, gain[0]), hn::Set(d, gain[1]), hn::Set(d, gain[2])};
    Vector black[3] = {hn::Set(d, rows.black), hn::Set(d, rows.black), hn::Set(d, rows.black)};
    std::size_t i = 0;
    for (; i + lanes() <= count; i += lanes()) {
        hn::Vec<decltype(narrow)> r, g, b;
        hn::LoadInterleaved3(narrow, samples + 3 * i, r, g, b);
        if (dark) hn::LoadInterleaved3(d, dark + 3 * i, black[0], black[1], black[2]);
        const Vector wide[3] = {widened(r), widened(g), widened(b)};
        for (int c = 0; c < 3; ++c) store(hn::Mul(hn::Mul(hn::Sub(wide[c], black[c]), scale), gains[c]), rgb[c], i);
        const auto clipped = hn::Ge(hn::Max(hn::Max(wide[0], wide[1]), wide[2]), limit);
        store(hn::IfThenElse(clipped, one, load(block.clipped, i)), block.clipped, i);
    }
    for (; i < count; ++i) {
        const Sample* s = samples + 3 * i;
        for (std::size_t c = 0; c < 3; ++c) {
            const float level = dark ? dark[3 * i + c] : rows.black;
            rgb[c].at[i] = (static_cast<float>(s[c]) - level) * rows.scale * gain[c];
        }
        if (static_cast<float>(std::max({s[0], s[1], s[2]})) >= rows.limit) block.clipped.at[i] = 1.0F;
    }
}

template <class Sample>
void load_curved(const PhotoRows& rows, const Sample* samples, const std::array<float, 3>& gain, Plane* rgb,
                 LeastSquaresBlock& block) {
    const float* curve = rows.curve->data();
    for (std::size_t i = 0; i < static_cast<std::size_t>(block.count); ++i) {
        const Sample* s = samples + 3 * i;
        for (std::size_t c = 0; c < 3; ++c) rgb[c].at[i] = curve[s[c]] * gain[c];
        if (static_cast<float>(std::max({s[0], s[1], s[2]})) >= rows.limit) block.clipped.at[i] = 1.0F;
    }
}

template <class Sample>
void load_samples(const PhotoRows& rows, int row, int column, const std::array<float, 3>& gain, Plane* rgb,
                  LeastSquaresBlock& block) {
    const auto first = std::ptrdiff_t{3} * column;
    const Sample* samples = rows.samples.ptr<Sample>(row) + first;
    if (rows.curve)
        load_curved(rows, samples, gain, rgb, block);
    else
        load_linear(rows, samples, rows.dark.empty() ? nullptr : rows.dark.ptr<float>(row) + first, gain, rgb, block);
}

void load_photo(const PhotoRows& rows, int row, int column, const std::array<float, 3>& gain, std::size_t light,
                LeastSquaresBlock& block) {
    Plane* rgb = block.rgb(light);
    switch (rows.samples.depth()) {
        case CV_8U:
            return load_samples<std::uint8_t>(rows, row, column, gain, rgb, block);
        case CV_16U:
            return load_samples<std::uint16_t>(rows, row, column, gain, rgb, block);
        default: {
            const auto first = std::ptrdiff_t{3} * column;
            const float* dark = rows.dark.empty() ? nullptr : rows.dark.ptr<float>(row) + first;
            load_linear(rows, rows.samples.ptr<float>(row) + first, dark, gain, rgb, block);
        }
    }
}

inline Vector mean_sample(const Plane* rgb, std::size_t i) {
    const Vector sum = hn::Add(hn::Add(load(rgb[0], i), load(rgb[1], i)), load(rgb[2], i));
    return hn::Mul(sum, hn::Set(Floats(), 1.0F / 3.0F));
}

void project(const LightSet& set, LeastSquaresBlock& block) {
    const Floats d;
    for (std::size_t i = 0; i < static_cast<std::size_t>(block.count); i += lanes()) {
        Vector x = hn::Zero(d), y = hn::Zero(d), z = hn::Zero(d);
        for (std::size_t k = 0; k < set.lights.size(); ++k) {
            const float* p = set.lights[k].pseudo_column.data();
            const Vector mean = mean_sample(block.rgb(k), i);
            x = hn::Add(x, hn::Mul(hn::Set(d, p[0]), mean));
            y = hn::Add(y, hn::Mul(hn::Set(d, p[1]), mean));
            z = hn::Add(z, hn::Mul(hn::Set(d, p[2]), mean));
        }
        store(x, block.g[0], i);
        store(y, block.g[1], i);
        store(z, block.g[2], i);
    }
}

void accumulate_albedo(const LightSet& set, LeastSquaresBlock& block) {
    const Floats d;
    const Vector zero = hn::Zero(d);
    for (std::size_t i = 0; i < static_cast<std::size_t>(block.count); i += lanes()) {
        const Vector x = load(block.g[0], i), y = load(block.g[1], i), z = load(block.g[2], i);
        Vector red = zero, green = zero, blue = zero, weight = zero, squared = zero;
        for (std::size_t k = 0; k < set.lights.size(); ++k) {
            const float* l = set.lights[k].direction.data();
            const Plane* rgb = block.rgb(k);
            const Vector shading = hn::Add(hn::Add(hn::Mul(x, hn::Set(d, l[0])), hn::Mul(y, hn::Set(d, l[1]))),
                                           hn::Mul(z, hn::Set(d, l[2])));
            const Vector lit = hn::Max(shading, zero);
            const Vector error = hn::Sub(mean_sample(rgb, i), shading);
            red = hn::Add(red, hn::Mul(load(rgb[0], i), lit));
            green = hn::Add(green, hn::Mul(load(rgb[1], i), lit));
            blue = hn::Add(blue, hn::Mul(load(rgb[2], i), lit));
            weight = hn::Add(weight, hn::Mul(lit, lit));
            squared = hn::Add(squared, hn::Mul(error, error));
        }
        store(red, block.colour[0], i);
        store(green, block.colour[1], i);
        store(blue, block.colour[2], i);
        store(weight, block.lit_weight, i);
        store(squared, block.squared, i);
    }
}

/// Interleaves three planes' pixels [i, i + lanes) into place; fewer at the block's end.
inline void put(Vector a, Vector b, Vector c, std::size_t i, std::size_t count, float* out) {
    const Floats d;
    if (i + lanes() <= count) return hn::StoreInterleaved3(a, b, c, d, out + 3 * i);
    HWY_ALIGN float whole[3 * hn::MaxLanes(Floats())];
    hn::StoreInterleaved3(a, b, c, d, whole);
    std::copy_n(whole, 3 * (count - i), out + 3 * i);
}

void finish(float min_albedo, LeastSquaresBlock& block, const BlockResults& results) {
    const Floats d;
    const Vector zero = hn::Zero(d), one = hn::Set(d, 1.0F), darkest = hn::Set(d, min_albedo);
    const auto count = static_cast<std::size_t>(block.count);
    for (std::size_t i = 0; i < count; i += lanes()) {
        const Vector x = load(block.g[0], i), y = load(block.g[1], i), z = load(block.g[2], i);
        const Vector length = hn::Sqrt(hn::Add(hn::Add(hn::Mul(x, x), hn::Mul(y, y)), hn::Mul(z, z)));
        const Vector weight = load(block.lit_weight, i);
        const Vector scale = hn::Div(length, weight);
        const Vector red = hn::Mul(load(block.colour[0], i), scale), green = hn::Mul(load(block.colour[1], i), scale),
                     blue = hn::Mul(load(block.colour[2], i), scale);
        const Vector albedo = hn::Mul(hn::Add(hn::Add(red, green), blue), hn::Set(d, 1.0F / 3.0F));
        const auto solved = hn::And(hn::Gt(length, zero), hn::Gt(weight, zero));
        const auto usable = hn::Gt(load(block.usable, i), zero);
        const auto valid = hn::And(hn::And(solved, usable), hn::Ge(albedo, darkest));
        put(hn::IfThenElseZero(valid, hn::Div(x, length)), hn::IfThenElseZero(valid, hn::Div(y, length)),
            hn::IfThenElseZero(valid, hn::Div(z, length)), i, count, results.normal);
        put(hn::IfThenElseZero(valid, red), hn::IfThenElseZero(valid, green), hn::IfThenElseZero(valid, blue), i, count,
            results.albedo);
        const Vector residual =
            hn::IfThenElseZero(valid, hn::Sqrt(hn::Div(load(block.squared, i), load(block.samples_used, i))));
        store(residual, block.squared, i);
        store(hn::IfThenElseZero(valid, one), block.usable, i);
    }
    std::copy_n(block.squared.at.data(), count, results.residual);
}

}  // namespace HWY_NAMESPACE
}  // namespace darkbox
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace darkbox {

HWY_EXPORT(load_photo);
HWY_EXPORT(project);
HWY_EXPORT(accumulate_albedo);
HWY_EXPORT(finish);

LeastSquaresBlock::LeastSquaresBlock(std::size_t lights) : samples(std::make_unique<Plane[]>(3 * lights)) {}

void load_photo(const PhotoRows& rows, int row, int column, const std::array<float, 3>& gain, std::size_t light,
                LeastSquaresBlock& block) {
    HWY_DYNAMIC_DISPATCH(load_photo)(rows, row, column, gain, light, block);
    if (rows.clipped.empty()) return;
    const uchar* clipped = rows.clipped[row] + column;
    for (int i = 0; i < block.count; ++i)
        if (clipped[i] != 0) block.clipped.at[static_cast<std::size_t>(i)] = 1.0F;
}

void project(const LightSet& set, LeastSquaresBlock& block) { HWY_DYNAMIC_DISPATCH(project)(set, block); }

void accumulate_albedo(const LightSet& set, LeastSquaresBlock& block) {
    HWY_DYNAMIC_DISPATCH(accumulate_albedo)(set, block);
}

void finish(float min_albedo, LeastSquaresBlock& block, const BlockResults& results) {
    HWY_DYNAMIC_DISPATCH(finish)(min_albedo, block, results);
}

bool clipped_at(const PhotoRows& rows, int row, int column) {
    if (!rows.clipped.empty()) return rows.clipped(row, column) != 0;
    const cv::Range here(row, row + 1), there(column, column + 1);
    PhotoRows pixel;
    pixel.samples = rows.samples(here, there);
    pixel.limit = rows.limit;
    return clipped_of(pixel)(0, 0) != 0;
}

}  // namespace darkbox
#endif
