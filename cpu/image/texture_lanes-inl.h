// Colours of textures, one sample a lane.
#if defined(MORPHRAY_CPU_IMAGE_TEXTURE_LANES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_IMAGE_TEXTURE_LANES_INL_H
#undef MORPHRAY_CPU_IMAGE_TEXTURE_LANES_INL_H
#else
#define MORPHRAY_CPU_IMAGE_TEXTURE_LANES_INL_H
#endif

#include <hwy/highway.h>

#include <cstddef>
#include <cstdint>

#include "cpu/image/lit_shader.h"
#include "cpu/image/texture.h"
#include "cpu/simd/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {
using namespace simd::HWY_NAMESPACE;

/// What triangles with these albedos give back of the light: the colours, multiplied by the texture
/// where they have one. through, depth: as in TexturedSample; a sample with a depth of 0 or less
/// has no hit, and any colour.
HWY_INLINE lanes::Float3 base_colours(const LitSamples& s, UintVec albedo, UintVec prim, FloatVec u,
                                      FloatVec v, const lanes::Float3& through, FloatVec depth) {
    const lanes::Float3 base = lanes::albedo_colour(albedo);
    const auto is_textured = (albedo & kTexturedBit) == splat(kTexturedBit);
    if (HWY_LIKELY(none(is_textured))) return base;
    alignas(64) std::uint32_t bits[kLanes], prims[kLanes];
    alignas(64) float at_u[kLanes], at_v[kLanes], depths[kLanes], dirs[3][kLanes];
    alignas(64) float colours[3][kLanes] = {};
    store(albedo, bits);
    store(prim, prims);
    store(u, at_u);
    store(v, at_v);
    store(depth, depths);
    store(through.x, dirs[0]);
    store(through.y, dirs[1]);
    store(through.z, dirs[2]);
    const vec3 du = s.params.camera.du;
    const double spacing_squared = double{du.x} * du.x + double{du.y} * du.y + double{du.z} * du.z;
    // Texels lie anywhere in memory, so lanes would not save much.
    for (std::size_t l = 0; l < kLanes; ++l) {
        if ((bits[l] & kTexturedBit) == 0 || !(depths[l] > 0.0f)) continue;
        const uvec3 t = s.topology.triangles[prims[l]];
        const uvec3 colour = texture_colour(
            s.textures, {.prim = prims[l],
                         .u = at_u[l],
                         .v = at_v[l],
                         .corners = {s.positions[t.x], s.positions[t.y], s.positions[t.z]},
                         .through = {dirs[0][l], dirs[1][l], dirs[2][l]},
                         .depth = depths[l],
                         .spacing_squared = spacing_squared});
        for (int k = 0; k < 3; ++k) colours[k][l] = static_cast<float>(colour[k]);
    }
    const lanes::Float3 texture(load(colours[0]), load(colours[1]), load(colours[2]));
    return select(float_mask(is_textured), lanes::textured_colour(base, texture), base);
}

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif  // per target
