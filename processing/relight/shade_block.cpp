#include "processing/relight/shade_block.h"

#include <algorithm>
#include <cstring>

// Highway compiles this file once for each kind of processor.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "processing/relight/shade_block.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
// After highway.h, which they rest on.
#include <hwy/contrib/math/math-inl.h>

HWY_BEFORE_NAMESPACE();
namespace darkbox {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using Floats = hn::CappedTag<float, block_pixels>;
using Integers = hn::RebindToSigned<Floats>;
using Vector = hn::Vec<Floats>;

/// R, G, B and one to spare of one pixel; not of Highway, whose scalar target has no four lanes.
using Colour [[gnu::vector_size(16)]] = float;

inline Colour load_colour(const float* from) {
    Colour colour;
    std::memcpy(&colour, from, sizeof colour);
    return colour;
}
inline void store_colour(Colour colour, float* to) { std::memcpy(to, &colour, sizeof colour); }

constexpr float largest_normal = 32767.0F;

inline Vector set(double value) { return hn::Set(Floats(), static_cast<float>(value)); }
inline Vector zero() { return hn::Zero(Floats()); }

/// Calls body(i) for the first of each vector of pixels.
template <class Body>
void for_vectors(Body&& body) {
    for (std::size_t i = 0; i < block_pixels; i += hn::Lanes(Floats())) body(i);
}

// Compact and back

void compact(const PixelBlock& from, CompactBlock& to) {
    const Floats d;
    const hn::Rebind<std::int16_t, Floats> shorts;
    const hn::Rebind<hwy::float16_t, Floats> halves;
    const Vector largest_half = set(65504.0);
    for_vectors([&](std::size_t i) {
        for (int c = 0; c < 3; ++c) {
            const Vector n = hn::Mul(hn::Load(d, from.normal[c] + i), set(largest_normal));
            hn::Store(hn::DemoteTo(shorts, hn::NearestInt(n)), shorts, to.normal[c] + i);
            const Vector detail = hn::Min(hn::Load(d, from.detail[c] + i), largest_half);
            hn::Store(hn::BitCast(hn::RebindToUnsigned<decltype(halves)>(), hn::DemoteTo(halves, detail)),
                      hn::RebindToUnsigned<decltype(halves)>(), to.detail[c] + i);
        }
    });
    std::copy_n(from.texel, block_pixels, to.texel);
}

/// A normal of 16 bits is a unit vector but for 3e-5, which a high power tells: `unit` makes it one again.
template <bool unit>
void expand(const CompactBlock& from, PixelBlock& to) {
    const Floats d;
    const hn::Rebind<std::int16_t, Floats> shorts;
    const hn::Rebind<std::uint16_t, Floats> words;
    const hn::Rebind<hwy::float16_t, Floats> halves;
    const Vector scale = set(1.0 / largest_normal);
    for_vectors([&](std::size_t i) {
        const auto component = [&](int c) {
            return hn::Mul(hn::ConvertTo(d, hn::PromoteTo(Integers(), hn::Load(shorts, from.normal[c] + i))), scale);
        };
        Vector x = component(0), y = component(1), z = component(2);
        if constexpr (unit) {
            const Vector squared = hn::Add(hn::Add(hn::Mul(x, x), hn::Mul(y, y)), hn::Mul(z, z));
            const Vector factor = hn::Div(set(1), hn::Sqrt(squared));
            x = hn::Mul(x, factor);
            y = hn::Mul(y, factor);
            z = hn::Mul(z, factor);
        }
        hn::Store(x, d, to.normal[0] + i);
        hn::Store(y, d, to.normal[1] + i);
        hn::Store(z, d, to.normal[2] + i);
        hn::Store(hn::PromoteTo(Integers(), hn::Load(words, from.texel + i)), Integers(), to.texel + i);
        for (int c = 0; c < 3; ++c) {
            const auto bits = hn::Load(words, from.detail[c] + i);
            hn::Store(hn::PromoteTo(d, hn::BitCast(halves, bits)), d, to.detail[c] + i);
        }
    });
}

// Light

/// What a block receives before detail and exposure.
struct alignas(64) Received {
    float through_shading[4 * block_pixels];  ///< R, G, B and one to spare of each pixel
    float mirrored[3][block_pixels];          ///< planes; only of models with a part that does not go through S
};

/// Where each pixel looks its texel's shading up.
struct alignas(64) Positions {
    std::int32_t entry[block_pixels];  ///< of the level below
    float fraction[block_pixels];      ///< 0 = there, 1 = at the level above
    float factor[block_pixels];        ///< on what is found; 1 but for OutOfRange::scale
};

inline hn::Mask<Floats> inside(const PixelBlock& block, std::size_t i) {
    return hn::RebindMask(Floats(), hn::Gt(hn::Load(Integers(), block.texel + i), hn::Zero(Integers())));
}

inline void put_position(const Frame& frame, const PixelBlock& block, Vector r, std::size_t i, Positions& to) {
    const Floats d;
    const Vector last = set(frame.levels - 1);
    const Vector position = hn::Mul(hn::Clamp(r, zero(), set(1)), last);
    const auto below = hn::Min(hn::ConvertTo(Integers(), position), hn::Set(Integers(), frame.levels - 2));
    const auto row = hn::Mul(hn::Load(Integers(), block.texel + i), hn::Set(Integers(), frame.levels));
    hn::Store(hn::Add(row, below), Integers(), to.entry + i);
    hn::Store(hn::Sub(position, hn::ConvertTo(d, below)), d, to.fraction + i);
    if (frame.options.out_of_range == OutOfRange::scale) hn::Store(hn::Max(r, set(1)), d, to.factor + i);
}

/// Direction and strength of a light at vector i of a block: the same for all, or each pixel's own.
struct ParallelRays {
    explicit ParallelRays(const DistantLight& light)
        : direction_{set(light.direction[0]), set(light.direction[1]), set(light.direction[2])} {}

    Vector direction(int c, std::size_t) const { return direction_[c]; }
    Vector attenuated(Vector value, std::size_t) const { return value; }

private:
    Vector direction_[3];
};
struct LampRays {
    const RayBlock& rays;

    Vector direction(int c, std::size_t i) const { return hn::Load(Floats(), rays.direction[c] + i); }
    Vector attenuated(Vector value, std::size_t i) const {
        return hn::Mul(value, hn::Load(Floats(), rays.falloff + i));
    }
};

/// N.L and (R.V)^n of the models.
template <class Rays>
struct Reflection {
    Reflection(const Frame& frame, const Rays& rays_of) : rays(rays_of), exponent(set(frame.options.phong_exponent)) {}

    Vector n_dot_l(const PixelBlock& block, std::size_t i) const {
        const Floats d;
        const Vector along_y = hn::Mul(hn::Load(d, block.normal[1] + i), rays.direction(1, i));
        const Vector along_xy = hn::MulAdd(hn::Load(d, block.normal[0] + i), rays.direction(0, i), along_y);
        return hn::MulAdd(hn::Load(d, block.normal[2] + i), rays.direction(2, i), along_xy);
    }

    /// 0 where the light is behind the surface.
    Vector highlight(const PixelBlock& block, Vector cosine, std::size_t i) const {
        const Floats d;
        const Vector normal_z = hn::Load(d, block.normal[2] + i);
        const Vector r_dot_v = hn::Sub(hn::Mul(hn::Mul(set(2), cosine), normal_z), rays.direction(2, i));
        const auto visible = hn::And(hn::Gt(r_dot_v, set(1e-30)), hn::Gt(cosine, zero()));
        const Vector power =
            hn::Exp(d, hn::Max(hn::Mul(exponent, hn::Log(d, hn::IfThenElse(visible, r_dot_v, set(1)))), set(-87)));
        return hn::IfThenElseZero(visible, power);
    }

    const Rays& rays;
    Vector exponent;
};

template <class Rays>
void locate(const Frame& frame, const PixelBlock& block, const Rays& rays, const cv::Vec3f& intensity,
            Positions& positions, Received& received) {
    const Floats d;
    const Reflection<Rays> reflection(frame, rays);
    const Vector diffuse = set(frame.options.phong_diffuse), specular = set(frame.options.phong_specular);
    const cv::Vec3d& colour = frame.options.specular_colour;
    switch (frame.options.model) {
        case ReflectanceModel::lambert:
            return for_vectors(
                [&](std::size_t i) { put_position(frame, block, reflection.n_dot_l(block, i), i, positions); });
        case ReflectanceModel::phong:
            return for_vectors([&](std::size_t i) {
                const Vector cosine = reflection.n_dot_l(block, i);
                const Vector r = hn::Add(hn::Mul(diffuse, hn::Max(cosine, zero())),
                                         hn::Mul(specular, reflection.highlight(block, cosine, i)));
                put_position(frame, block, r, i, positions);
            });
        case ReflectanceModel::phong_split:
            return for_vectors([&](std::size_t i) {
                const Vector cosine = reflection.n_dot_l(block, i);
                put_position(frame, block, cosine, i, positions);
                const Vector gloss = hn::Mul(specular, reflection.highlight(block, cosine, i));
                const Vector highlight = hn::IfThenElseZero(inside(block, i), rays.attenuated(gloss, i));
                for (int c = 0; c < 3; ++c) {
                    float* to = received.mirrored[c] + i;
                    const Vector more = hn::Mul(set(colour[c] * intensity[c]), highlight);
                    hn::Store(hn::Add(hn::Load(d, to), more), d, to);
                }
            });
    }
}

/// received += intensity x S at the positions. One pixel at a time: its four lanes are R, G, B.
template <bool first, bool scaled>
void add_shading(const Frame& frame, const Positions& positions, const cv::Vec3f& intensity, Received& received) {
    const Colour colour{intensity[0], intensity[1], intensity[2], 0};
    const float* shading = frame.shading->val;
    for (std::size_t p = 0; p < block_pixels; ++p) {
        const float* entry = shading + std::size_t{4} * static_cast<std::uint32_t>(positions.entry[p]);
        const Colour below = load_colour(entry), above = load_colour(entry + 4);
        Colour value = below + positions.fraction[p] * (above - below);
        if constexpr (scaled) value *= positions.factor[p];
        value *= colour;
        float* to = received.through_shading + 4 * p;
        if constexpr (!first) value += load_colour(to);
        store_colour(value, to);
    }
}

/// Makes the positions' factors those of the fall-off too.
void attenuate(const LampRays& rays, bool scaled, Positions& positions) {
    for_vectors([&](std::size_t i) {
        const Vector factor = scaled ? hn::Load(Floats(), positions.factor + i) : set(1);
        hn::Store(rays.attenuated(factor, i), Floats(), positions.factor + i);
    });
}

void locate_near(const Frame& frame, const PixelBlock& block, const PointBlock& points, const FrameLight& light,
                 Positions& positions, Received& received) {
    RayBlock arriving;
    find_rays(*light.near, points, arriving);
    const LampRays rays{arriving};
    locate(frame, block, rays, light.distant.intensity, positions, received);
    attenuate(rays, frame.options.out_of_range == OutOfRange::scale, positions);
}

void receive_from_lights(const Frame& frame, const PixelBlock& block, const PointBlock* points, Received& received) {
    Positions positions;
    const bool split = frame.options.model == ReflectanceModel::phong_split;
    const float diffuse = split ? static_cast<float>(frame.options.phong_diffuse) : 1.0F;
    if (split) std::fill_n(received.mirrored[0], 3 * block_pixels, 0.0F);
    for (const FrameLight& light : frame.lights) {
        if (light.near)
            locate_near(frame, block, *points, light, positions, received);
        else
            locate(frame, block, ParallelRays(light.distant), light.distant.intensity, positions, received);
        const bool scaled = light.near || frame.options.out_of_range == OutOfRange::scale;
        const cv::Vec3f intensity = light.distant.intensity * diffuse;
        const bool first = &light == frame.lights.data();
        if (first && scaled) add_shading<true, true>(frame, positions, intensity, received);
        if (first && !scaled) add_shading<true, false>(frame, positions, intensity, received);
        if (!first && scaled) add_shading<false, true>(frame, positions, intensity, received);
        if (!first && !scaled) add_shading<false, false>(frame, positions, intensity, received);
    }
}

/// Where each pixel's normal falls in the grid of a folded environment.
struct alignas(64) Cells {
    std::int32_t node[block_pixels];  ///< top left
    float right[block_pixels];        ///< 0...1 of the cell
    float down[block_pixels];
};

/// FoldedEnvironment's square: the hemisphere z >= 0 by the octahedral map, turned by 45 degrees.
void find_cells(int nodes, const PixelBlock& block, Cells& cells) {
    const Floats d;
    const Vector half_cells = set(0.5 * (nodes - 1));
    const auto last = hn::Set(Integers(), nodes - 2);
    const auto along = [&](Vector square, std::size_t i, float* fraction) {
        const Vector position = hn::Max(hn::Mul(hn::Add(square, set(1)), half_cells), zero());
        const auto below = hn::Min(hn::ConvertTo(Integers(), position), last);
        hn::Store(hn::Sub(position, hn::ConvertTo(d, below)), d, fraction + i);
        return below;
    };
    for_vectors([&](std::size_t i) {
        const Vector x = hn::Load(d, block.normal[0] + i), y = hn::Load(d, block.normal[1] + i);
        const Vector z = hn::Max(hn::Load(d, block.normal[2] + i), zero());
        const Vector scale = hn::Div(set(1), hn::Add(hn::Add(hn::Abs(x), hn::Abs(y)), z));
        const auto column = along(hn::Mul(hn::Add(x, y), scale), i, cells.right);
        const auto row = along(hn::Mul(hn::Sub(x, y), scale), i, cells.down);
        hn::Store(hn::Add(hn::Mul(row, hn::Set(Integers(), nodes)), column), Integers(), cells.node + i);
    });
}

/// Bilinear in a table of `width` colours a node, of which pixel p takes number texel[p].
template <class Texel>
void look_up_cells(const cv::Vec4f* table, int nodes, int width, const Cells& cells, Texel&& texel, float* colours) {
    const std::size_t to_right = std::size_t{4} * width, to_bottom = to_right * nodes;
    for (std::size_t p = 0; p < block_pixels; ++p) {
        const float* top = table->val + to_right * static_cast<std::uint32_t>(cells.node[p]) + 4 * texel(p);
        const auto across = [&](const float* left) {
            const Colour at_left = load_colour(left);
            return at_left + cells.right[p] * (load_colour(left + to_right) - at_left);
        };
        const Colour upper = across(top), lower = across(top + to_bottom);
        store_colour(upper + cells.down[p] * (lower - upper), colours + 4 * p);
    }
}

void receive_from_environment(const FoldedEnvironment& environment, const PixelBlock& block, Received& received) {
    Cells cells;
    const int nodes = environment.nodes();
    find_cells(nodes, block, cells);
    if (!environment.mirrored().empty()) {
        look_up_cells(
            environment.mirrored().data(), nodes, 1, cells, [](std::size_t) { return std::size_t{0}; },
            received.through_shading);
        for_vectors([&](std::size_t i) {
            Vector rgb[3], spare;
            hn::LoadInterleaved4(Floats(), received.through_shading + 4 * i, rgb[0], rgb[1], rgb[2], spare);
            for (int c = 0; c < 3; ++c)
                hn::Store(hn::IfThenElseZero(inside(block, i), rgb[c]), Floats(), received.mirrored[c] + i);
        });
    }
    look_up_cells(
        environment.shading(), nodes, environment.texels() + 1, cells,
        [&](std::size_t p) { return static_cast<std::size_t>(block.texel[p]); }, received.through_shading);
}

/// Returns whether `mirrored` was filled.
bool receive(const Frame& frame, const PixelBlock& block, const PointBlock* points, Received& received) {
    if (frame.environment) {
        receive_from_environment(*frame.environment, block, received);
        return !frame.environment->mirrored().empty();
    }
    if (frame.constant_r >= 0) {
        Positions positions;
        for_vectors([&](std::size_t i) { put_position(frame, block, set(frame.constant_r), i, positions); });
        add_shading<true, false>(frame, positions, {1, 1, 1}, received);
        return false;
    }
    receive_from_lights(frame, block, points, received);
    return frame.options.model == ReflectanceModel::phong_split;
}

// Pixels

/// Calls put(i, r, g, b) with the radiance of each vector of pixels.
template <class Put>
void finish(const Frame& frame, const PixelBlock& block, const Received& received, bool mirrored, Put&& put) {
    const Floats d;
    const Vector exposure = set(frame.options.exposure);
    const bool detail = frame.options.lookup == Lookup::detail;
    for_vectors([&](std::size_t i) {
        Vector rgb[3], spare;
        hn::LoadInterleaved4(d, received.through_shading + 4 * i, rgb[0], rgb[1], rgb[2], spare);
        for (int c = 0; c < 3; ++c) {
            if (detail) rgb[c] = hn::Mul(rgb[c], hn::Load(d, block.detail[c] + i));
            if (mirrored) rgb[c] = hn::Add(rgb[c], hn::Load(d, received.mirrored[c] + i));
            rgb[c] = hn::Mul(rgb[c], exposure);
        }
        put(i, rgb[0], rgb[1], rgb[2]);
    });
}

/// 255 times the sRGB curve of 0...1: the line near black, elsewhere a polynomial of the square root that is 0.09
/// levels off at most (minimax over 0.0031308...1).
HWY_INLINE Vector srgb_level(Vector linear) {
    const Vector root = hn::Sqrt(linear);
    constexpr double coefficients[] = {0.51730531, -1.62366346, 2.03157759, -1.40273654, 1.51795065, -0.04010959};
    Vector curve = set(255 * coefficients[0]);
    for (int i = 1; i < 6; ++i) curve = hn::MulAdd(curve, root, set(255 * coefficients[i]));
    return hn::IfThenElse(hn::Le(linear, set(0.0031308)), hn::Mul(linear, set(255 * 12.92)), curve);
}

template <Encoding encoding>
HWY_INLINE auto level_of(Vector linear) {
    const hn::RebindToUnsigned<Floats> words;
    const hn::Rebind<std::uint8_t, Floats> bytes;
    const Vector cut = hn::Clamp(linear, zero(), set(1));
    const Vector level = encoding == Encoding::srgb ? srgb_level(cut) : hn::Mul(cut, set(255));
    // At 2^23 a float has no room for fractions: the addition rounds, and leaves the integer in the lowest bits.
    return hn::TruncateTo(bytes, hn::BitCast(words, hn::Add(level, set(8388608))));
}

template <Encoding encoding>
void put_bytes(const Frame& frame, const PixelBlock& block, const Received& received, bool mirrored,
               std::uint8_t* pixels) {
    const hn::Rebind<std::uint8_t, Floats> bytes;
    finish(frame, block, received, mirrored, [&](std::size_t i, Vector r, Vector g, Vector b) {
        hn::StoreInterleaved3(level_of<encoding>(r), level_of<encoding>(g), level_of<encoding>(b), bytes,
                              pixels + 3 * i);
    });
}

void to_floats(const Frame& frame, const PixelBlock& block, const PointBlock* points, float* pixels) {
    Received received;
    const bool mirrored = receive(frame, block, points, received);
    finish(frame, block, received, mirrored, [&](std::size_t i, Vector r, Vector g, Vector b) {
        hn::StoreInterleaved3(r, g, b, Floats(), pixels + 3 * i);
    });
}

void to_bytes(const Frame& frame, const CompactBlock& compact_block, const PointBlock* points, Encoding encoding,
              std::uint8_t* pixels) {
    PixelBlock block;
    Received received;
    if (frame.options.model == ReflectanceModel::lambert)
        expand<false>(compact_block, block);
    else
        expand<true>(compact_block, block);
    const bool mirrored = receive(frame, block, points, received);
    if (encoding == Encoding::srgb)
        put_bytes<Encoding::srgb>(frame, block, received, mirrored, pixels);
    else
        put_bytes<Encoding::linear>(frame, block, received, mirrored, pixels);
}

}  // namespace HWY_NAMESPACE
}  // namespace darkbox
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace darkbox {

HWY_EXPORT(compact);
HWY_EXPORT(to_floats);
HWY_EXPORT(to_bytes);

void shade_to_floats(const Frame& frame, const PixelBlock& block, const PointBlock* points, float* rgb) {
    HWY_DYNAMIC_DISPATCH(to_floats)(frame, block, points, rgb);
}

void shade_to_bytes(const Frame& frame, const CompactBlock& block, const PointBlock* points, Encoding encoding,
                    std::uint8_t* rgb) {
    HWY_DYNAMIC_DISPATCH(to_bytes)(frame, block, points, encoding, rgb);
}

CompactBlock compacted(const PixelBlock& block) {
    CompactBlock result;
    HWY_DYNAMIC_DISPATCH(compact)(block, result);
    return result;
}

}  // namespace darkbox
#endif
