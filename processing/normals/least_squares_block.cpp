#include "processing/normals/least_squares_block.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <type_traits>

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

/// Linear samples; `dark` is null where a constant is subtracted. Returns whether any sample is clipped.
template <class Sample>
bool load_linear(const PhotoRows& rows, const Sample* samples, const float* dark, const std::array<float, 3>& gain,
                 Plane* rgb, std::size_t count) {
    const Floats d;
    const hn::Rebind<Sample, Floats> narrow;
    const Vector scale = hn::Set(d, rows.scale);
    const Vector gains[3] = {hn::Set(d, gain[0]), hn::Set(d, gain[1]), hn::Set(d, gain[2])};
    Vector black[3] = {hn::Set(d, rows.black), hn::Set(d, rows.black), hn::Set(d, rows.black)};
    Vector highest = hn::Set(d, -std::numeric_limits<float>::infinity());
    std::size_t i = 0;
    for (; i + lanes() <= count; i += lanes()) {
        hn::Vec<decltype(narrow)> r, g, b;
        hn::LoadInterleaved3(narrow, samples + 3 * i, r, g, b);
        if (dark) hn::LoadInterleaved3(d, dark + 3 * i, black[0], black[1], black[2]);
        const Vector wide[3] = {widened(r), widened(g), widened(b)};
        for (int c = 0; c < 3; ++c) store(hn::Mul(hn::Mul(hn::Sub(wide[c], black[c]), scale), gains[c]), rgb[c], i);
        highest = hn::Max(highest, hn::Max(hn::Max(wide[0], wide[1]), wide[2]));
    }
    float most = hn::GetLane(hn::MaxOfLanes(d, highest));
    for (; i < count; ++i) {
        const Sample* s = samples + 3 * i;
        for (std::size_t c = 0; c < 3; ++c) {
            const float level = dark ? dark[3 * i + c] : rows.black;
            rgb[c].at[i] = (static_cast<float>(s[c]) - level) * rows.scale * gain[c];
        }
        most = std::max(most, static_cast<float>(std::max({s[0], s[1], s[2]})));
    }
    return most >= rows.limit;
}

template <class Sample>
bool load_curved(const PhotoRows& rows, const Sample* samples, const std::array<float, 3>& gain, Plane* rgb,
                 std::size_t count) {
    const float* curve = rows.curve->data();
    Sample most = 0;
    for (std::size_t i = 0; i < count; ++i)
        for (std::size_t c = 0; c < 3; ++c) {
            const Sample sample = samples[3 * i + c];
            rgb[c].at[i] = curve[sample] * gain[c];
            most = std::max(most, sample);
        }
    return static_cast<float>(most) >= rows.limit;
}

bool load_photo(const PhotoRows& rows, int row, int column, const std::array<float, 3>& gain, std::size_t light,
                LeastSquaresBlock& block) {
    Plane* rgb = block.rgb(light);
    const auto first = std::ptrdiff_t{3} * column;
    const auto count = static_cast<std::size_t>(block.count);
    const float* dark = rows.dark.empty() ? nullptr : rows.dark.ptr<float>(row) + first;
    const auto load_samples = [&]<class Sample>(const Sample* samples) {
        if constexpr (!std::is_same_v<Sample, float>)
            if (rows.curve) return load_curved(rows, samples + first, gain, rgb, count);
        return load_linear(rows, samples + first, dark, gain, rgb, count);
    };
    switch (rows.samples.depth()) {
        case CV_8U:
            return load_samples(rows.samples.ptr<std::uint8_t>(row));
        case CV_16U:
            return load_samples(rows.samples.ptr<std::uint16_t>(row));
        default:
            return load_samples(rows.samples.ptr<float>(row));
    }
}

struct Colour {
    Vector r, g, b;
};

inline Vector mean(const Colour& c) { return hn::Mul(hn::Add(hn::Add(c.r, c.g), c.b), hn::Set(Floats(), 1.0F / 3.0F)); }

inline Colour load_colour(const Plane* rgb, std::size_t i) {
    return {load(rgb[0], i), load(rgb[1], i), load(rgb[2], i)};
}

/// All bits set where a byte of the mask is not 0.
inline hn::Mask<Floats> inside(const LeastSquaresBlock& block, std::size_t i) {
    const hn::RebindToSigned<Floats> words;
    const auto bytes = hn::LoadU(hn::Rebind<std::uint8_t, Floats>(), block.mask.data() + i);
    return hn::RebindMask(Floats(), hn::Gt(hn::PromoteTo(words, bytes), hn::Zero(words)));
}

/// Sums over lights of what leads to g.
struct Projection {
    Vector x, y, z;

    void add(const SolverLight& light, const Colour& sample) {
        const Floats d;
        const float* p = light.pseudo_column.data();
        const Vector grey = mean(sample);
        x = hn::MulAdd(hn::Set(d, p[0]), grey, x);
        y = hn::MulAdd(hn::Set(d, p[1]), grey, y);
        z = hn::MulAdd(hn::Set(d, p[2]), grey, z);
    }

    /// Returns how many pixels of the object are not finite.
    std::size_t put(std::size_t i, LeastSquaresBlock& block) const {
        const Floats d;
        store(x, block.g[0], i);
        store(y, block.g[1], i);
        store(z, block.g[2], i);
        // Zero times anything else than a finite number is not a number.
        const Vector trace = hn::Mul(hn::Add(hn::Add(x, y), z), hn::Zero(d));
        const auto finite = hn::Eq(trace, hn::Zero(d)), object = inside(block, i);
        store(hn::IfThenElseZero(hn::And(finite, object), hn::Set(d, 1.0F)), block.usable, i);
        return hn::CountTrue(d, hn::AndNot(finite, object));
    }
};

/// Sums over lights of what leads to albedo and residual.
struct AlbedoSums {
    Vector red, green, blue, weight, squared;

    void add(const SolverLight& light, const Projection& g, const Colour& sample) {
        const Floats d;
        const float* l = light.direction.data();
        const Vector shading =
            hn::MulAdd(g.z, hn::Set(d, l[2]), hn::MulAdd(g.y, hn::Set(d, l[1]), hn::Mul(g.x, hn::Set(d, l[0]))));
        const Vector lit = hn::Max(shading, hn::Zero(d));
        const Vector error = hn::Sub(mean(sample), shading);
        red = hn::MulAdd(sample.r, lit, red);
        green = hn::MulAdd(sample.g, lit, green);
        blue = hn::MulAdd(sample.b, lit, blue);
        weight = hn::MulAdd(lit, lit, weight);
        squared = hn::MulAdd(error, error, squared);
    }

    void put(std::size_t i, LeastSquaresBlock& block) const {
        store(red, block.colour[0], i);
        store(green, block.colour[1], i);
        store(blue, block.colour[2], i);
        store(weight, block.lit_weight, i);
        store(squared, block.squared, i);
    }
};

std::size_t project(const LightSet& set, LeastSquaresBlock& block) {
    const Vector zero = hn::Zero(Floats());
    std::size_t not_finite = 0;
    for (std::size_t i = 0; i < static_cast<std::size_t>(block.count); i += lanes()) {
        Projection g{zero, zero, zero};
        for (std::size_t k = 0; k < set.lights.size(); ++k) g.add(set.lights[k], load_colour(block.rgb(k), i));
        not_finite += g.put(i, block);
    }
    return not_finite;
}

void accumulate_albedo(const LightSet& set, LeastSquaresBlock& block) {
    const Vector zero = hn::Zero(Floats());
    for (std::size_t i = 0; i < static_cast<std::size_t>(block.count); i += lanes()) {
        const Projection g{load(block.g[0], i), load(block.g[1], i), load(block.g[2], i)};
        AlbedoSums sums{zero, zero, zero, zero, zero};
        for (std::size_t k = 0; k < set.lights.size(); ++k) sums.add(set.lights[k], g, load_colour(block.rgb(k), i));
        sums.put(i, block);
    }
}

template <class Sample>
std::optional<std::size_t> sum_plain(const PhotoBand& band, const LightSet& set, int row, int column,
                                     LeastSquaresBlock& block) {
    const Floats d;
    const hn::Rebind<Sample, Floats> narrow;
    const Vector zero = hn::Zero(d);
    const auto count = static_cast<std::size_t>(block.count);
    if (count % lanes() != 0) return std::nullopt;
    float* kept = block.samples.get()->at.data();  // a few pixels' linear samples of all lights
    std::size_t not_finite = 0;
    for (std::size_t i = 0; i < count; i += lanes()) {
        auto clipped = hn::MaskFromVec(zero);
        Projection g{zero, zero, zero};
        for (std::size_t k = 0; k < set.lights.size(); ++k) {
            const SolverLight& light = set.lights[k];
            const PhotoRows& rows = band.photos[light.image];
            const Sample* samples = rows.samples.ptr<Sample>(row, column) + 3 * i;
            // The photographs are more streams than the processor foresees.
            for (std::size_t ahead = 0; ahead < 3 * lanes(); ahead += 64 / sizeof(Sample))
                __builtin_prefetch(samples + 3 * block_pixels + ahead, 0, 3);
            hn::Vec<decltype(narrow)> r, green, b;
            hn::LoadInterleaved3(narrow, samples, r, green, b);
            const Vector wide[3] = {widened(r), widened(green), widened(b)};
            clipped = hn::Or(clipped, hn::Ge(hn::Max(hn::Max(wide[0], wide[1]), wide[2]), hn::Set(d, rows.limit)));
            const Vector black = hn::Set(d, rows.black), scale = hn::Set(d, rows.scale);
            const auto linear = [&](std::size_t c) {
                return hn::Mul(hn::Mul(hn::Sub(wide[c], black), scale), hn::Set(d, light.gain[c]));
            };
            const Colour sample{linear(0), linear(1), linear(2)};
            float* keep = kept + 3 * lanes() * k;
            hn::Store(sample.r, d, keep);
            hn::Store(sample.g, d, keep + lanes());
            hn::Store(sample.b, d, keep + 2 * lanes());
            g.add(light, sample);
        }
        if (!hn::AllFalse(d, clipped)) return std::nullopt;
        not_finite += g.put(i, block);
        AlbedoSums sums{zero, zero, zero, zero, zero};
        for (std::size_t k = 0; k < set.lights.size(); ++k) {
            const float* keep = kept + 3 * lanes() * k;
            sums.add(set.lights[k], g,
                     {hn::Load(d, keep), hn::Load(d, keep + lanes()), hn::Load(d, keep + 2 * lanes())});
        }
        sums.put(i, block);
    }
    return not_finite;
}

std::optional<std::size_t> sum_plain_samples(const PhotoBand& band, const LightSet& set, int row, int column,
                                             LeastSquaresBlock& block) {
    switch (band.photos[set.lights.front().image].samples.depth()) {
        case CV_8U:
            return sum_plain<std::uint8_t>(band, set, row, column, block);
        case CV_16U:
            return sum_plain<std::uint16_t>(band, set, row, column, block);
        default:
            return sum_plain<float>(band, set, row, column, block);
    }
}

/// Puts pixels [i, i + lanes) of one map into place; fewer at the block's end.
template <class Value, class Whole>
void put(std::size_t i, std::size_t count, std::size_t channels, Value* map, Whole store_whole) {
    if (i + lanes() <= count) return store_whole(map + channels * i);
    HWY_ALIGN Value whole[3 * block_pixels];
    store_whole(whole);
    std::copy_n(whole, channels * (count - i), map + channels * i);
}

void finish(float min_albedo, const LeastSquaresBlock& block, const BlockResults& results) {
    const Floats d;
    const hn::Rebind<std::uint8_t, Floats> bytes;
    const hn::Rebind<std::uint16_t, Floats> words;
    const Vector zero = hn::Zero(d), darkest = hn::Set(d, min_albedo), full = hn::Set(d, 255.0F);
    const auto count = static_cast<std::size_t>(block.count);
    for (std::size_t i = 0; i < count; i += lanes()) {
        const Vector x = load(block.g[0], i), y = load(block.g[1], i), z = load(block.g[2], i);
        const Vector length = hn::Sqrt(hn::Add(hn::Add(hn::Mul(x, x), hn::Mul(y, y)), hn::Mul(z, z)));
        const Vector weight = load(block.lit_weight, i), used = load(block.samples_used, i);
        const Vector scale = hn::Div(length, weight);
        const Vector red = hn::Mul(load(block.colour[0], i), scale), green = hn::Mul(load(block.colour[1], i), scale),
                     blue = hn::Mul(load(block.colour[2], i), scale);
        const Vector albedo = hn::Mul(hn::Add(hn::Add(red, green), blue), hn::Set(d, 1.0F / 3.0F));
        const auto solved = hn::And(hn::Gt(length, zero), hn::Gt(weight, zero));
        const auto usable = hn::Gt(load(block.usable, i), zero);
        const auto valid = hn::And(hn::And(solved, usable), hn::Ge(albedo, darkest));
        const auto kept = [&](Vector values) { return hn::IfThenElseZero(valid, values); };
        put(i, count, 3, results.normal, [&](float* to) {
            hn::StoreInterleaved3(kept(hn::Div(x, length)), kept(hn::Div(y, length)), kept(hn::Div(z, length)), d, to);
        });
        put(i, count, 3, results.albedo,
            [&](float* to) { hn::StoreInterleaved3(kept(red), kept(green), kept(blue), d, to); });
        put(i, count, 1, results.residual,
            [&](float* to) { hn::StoreU(kept(hn::Sqrt(hn::Div(load(block.squared, i), used))), d, to); });
        put(i, count, 1, results.valid, [&](std::uint8_t* to) {
            hn::StoreU(hn::DemoteTo(bytes, hn::ConvertTo(hn::RebindToSigned<Floats>(), kept(full))), bytes, to);
        });
        put(i, count, 1, results.lights_used, [&](std::uint16_t* to) {
            hn::StoreU(hn::DemoteTo(words, hn::ConvertTo(hn::RebindToSigned<Floats>(), kept(used))), words, to);
        });
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace darkbox
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace darkbox {

HWY_EXPORT(load_photo);
HWY_EXPORT(sum_plain_samples);
HWY_EXPORT(project);
HWY_EXPORT(accumulate_albedo);
HWY_EXPORT(finish);

LeastSquaresBlock::LeastSquaresBlock(std::size_t lights) : samples(std::make_unique<Plane[]>(3 * lights)) {}

/// The photographs are as many streams as there are lights, too many for the processor to foresee.
[[maybe_unused]] static void prefetch_next(const PhotoRows& rows, int row, int column, int count) {
    constexpr std::ptrdiff_t cache_line = 64;
    const auto bytes = static_cast<std::ptrdiff_t>(rows.samples.elemSize()) * count;
    const uchar* next = rows.samples.ptr(row, column) + bytes;
    const uchar* end = std::min(next + bytes, rows.samples.dataend);
    for (; next < end; next += cache_line) __builtin_prefetch(next, 0, 3);
}

bool load_photo(const PhotoRows& rows, int row, int column, const std::array<float, 3>& gain, std::size_t light,
                LeastSquaresBlock& block) {
    prefetch_next(rows, row, column, block.count);
    const bool at_limit = HWY_DYNAMIC_DISPATCH(load_photo)(rows, row, column, gain, light, block);
    if (rows.clipped.empty()) return at_limit;
    const uchar* clipped = rows.clipped[row] + column;
    return std::any_of(clipped, clipped + block.count, [](uchar c) { return c != 0; });
}

std::optional<std::size_t> sum_plain_samples(const PhotoBand& band, const LightSet& set, int row, int column,
                                             LeastSquaresBlock& block) {
    const int depth = band.photos[set.lights.front().image].samples.depth();
    const bool plain = std::all_of(set.lights.begin(), set.lights.end(), [&](const SolverLight& light) {
        const PhotoRows& rows = band.photos[light.image];
        return rows.samples.depth() == depth && !rows.curve && rows.dark.empty() && rows.clipped.empty();
    });
    if (!plain) return std::nullopt;
    return HWY_DYNAMIC_DISPATCH(sum_plain_samples)(band, set, row, column, block);
}

std::size_t project(const LightSet& set, LeastSquaresBlock& block) { return HWY_DYNAMIC_DISPATCH(project)(set, block); }

void accumulate_albedo(const LightSet& set, LeastSquaresBlock& block) {
    HWY_DYNAMIC_DISPATCH(accumulate_albedo)(set, block);
}

void finish(float min_albedo, const LeastSquaresBlock& block, const BlockResults& results) {
    HWY_DYNAMIC_DISPATCH(finish)(min_albedo, block, results);
}

}  // namespace darkbox
#endif
