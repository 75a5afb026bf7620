#pragma once

#include <cstdint>
#include <memory>

#include "sim/geometry.h"

namespace darkbox::sim {

/// Where a texture is asked for its colour.
struct SurfacePoint {
    Vec3 position;     ///< viewer frame, mm
    Vec2 uv;           ///< in tiles (one brick each); integers are joints
    Vec3 position_du;  ///< mm per tile; zero where the surface has no parameters
    Vec3 position_dv;
    int period_u = 0;  ///< tiles after which uv closes upon itself; 0 = never
    int period_v = 0;
};

/// Tile i of a surface that closes after `period` tiles, 0...period - 1; 0 = it never does.
constexpr std::int64_t wrapped(std::int64_t i, int period) { return period > 0 ? (i % period + period) % period : i; }

/// A procedural texture. Solid ones depend on the position alone and so have no seams. Thread-safe.
class Texture {
public:
    virtual ~Texture() = default;
    virtual Rgb albedo(const SurfacePoint& point) const = 0;
    /// Which of the texture's materials the point is of, 0...: what texels are to tell apart.
    virtual int material(const SurfacePoint&) const { return 0; }
    /// Relief above the smooth surface, mm; turns the normals only.
    virtual double height_mm(const SurfacePoint&) const { return 0.0; }
    virtual bool has_relief() const { return false; }
};
using TexturePtr = std::shared_ptr<const Texture>;

TexturePtr plain_texture(const Rgb& albedo);
/// Broken grey and ochre stone with darker joints between its grains. Materials: joint, grey, ochre.
TexturePtr stone_texture(std::uint64_t seed);
/// Stone overgrown by blotches of moss. Materials: stone, moss.
TexturePtr moss_texture(std::uint64_t seed);
/// Pale marble with dark veins. Materials: marble, vein.
TexturePtr marble_texture(std::uint64_t seed);
/// Dark and red speckles strewn over a pale ground. Materials: ground, dark, red.
TexturePtr speckle_texture(std::uint64_t seed);
/// Bricks in running bond, one to a tile, with mortar lying deeper than the bricks. Materials: mortar, brick.
TexturePtr brick_texture(std::uint64_t seed);
/// Coarse cloth of red warp and pale weft threads, each rising and diving. Materials: warp, weft.
TexturePtr weave_texture(std::uint64_t seed);
/// Blue cloth, softly creased, with flowers printed on it. Materials: ground, petal, heart.
TexturePtr print_texture(std::uint64_t seed);
/// A melon: a raised net of pale cork over a rind from green to ochre. Materials: rind, net.
TexturePtr melon_texture(std::uint64_t seed);

/// The unit normal of the surface with the texture's relief (Blinn: Simulation of wrinkled surfaces, 1978).
/// `normal`: unit normal of the smooth surface.
Vec3 normal_with_relief(const Texture& texture, const SurfacePoint& point, const Vec3& normal);

}  // namespace darkbox::sim
