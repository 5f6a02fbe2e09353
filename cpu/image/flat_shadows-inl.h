// The samples of a row that may be in shadow only because triangles are flat.
#if defined(MORPHRAY_CPU_IMAGE_FLAT_SHADOWS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_IMAGE_FLAT_SHADOWS_INL_H
#undef MORPHRAY_CPU_IMAGE_FLAT_SHADOWS_INL_H
#else
#define MORPHRAY_CPU_IMAGE_FLAT_SHADOWS_INL_H
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "cpu/image/lit_shader.h"
#include "cpu/image/triangle_runs-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {
using namespace simd::HWY_NAMESPACE;

/// Whether the smooth surface of samples x[lane] of row y, which have hits, is another than the
/// flat one and faces the light.
HWY_INLINE Mask is_smooth_lit(const LitSamples& s, const std::uint32_t* x, std::uint32_t y) {
    alignas(64) Hit hits[kLanes];
    const Hit* const row = &s.hits[std::size_t{y} * s.params.width];
    for (std::size_t i = 0; i < kLanes; ++i) hits[i] = row[x[i]];
    FloatVec t, u, v, prim;
    hn::LoadInterleaved4(kFloats, &hits[0].t, t, u, v, prim);
    const Camera& camera = s.params.camera;
    const lanes::Float3 dir =
        lanes::canonical_direction(lanes::camera_direction(camera, load_unaligned(x), splat(y)));
    lanes::Float3 corners[3], normals[3];
    load_corners(s.topology, s.positions, as_uint(prim), corners);
    const lanes::Surface flat =
        lanes::surface_of(lanes::Float3(camera.org), dir, t, corners[0], corners[1], corners[2]);
    load_corner_normals(s, as_uint(prim), flat.normal, normals);
    const lanes::Surface above = lanes::smooth_surface(flat, corners[0], corners[1], corners[2],
                                                       normals[0], normals[1], normals[2], u, v);
    const lanes::Float3 to_light = lanes::Float3(s.params.light) - flat.point;
    const Mask is_same = (above.point.x == flat.point.x) & (above.point.y == flat.point.y) &
                         (above.point.z == flat.point.z);
    return and_not(is_same, lanes::dot3(above.normal, to_light) > zero());
}

void find_flat_shadows(const LitSamples& s, std::uint32_t y, std::vector<std::uint32_t>& xs) {
    xs.clear();
    const std::size_t first = std::size_t{y} * s.params.width;
    for (std::uint32_t x = 0; x < s.params.width; ++x)
        if (s.shadows[first + x] != 0 && s.hits[first + x].prim_id != kNoPrim) xs.push_back(x);
    const std::size_t count = xs.size();
    if (count == 0) return;
    // Lanes without a sample have the last one.
    xs.resize(count + kLanes - 1, xs.back());
    std::size_t kept = 0;
    for (std::size_t at = 0; at < count; at += kLanes) {
        const std::size_t used = std::min<std::size_t>(kLanes, count - at);
        std::uint32_t bits = bits_of(is_smooth_lit(s, &xs[at], y)) & ((2u << (used - 1)) - 1);
        for (; bits != 0; bits &= bits - 1)
            xs[kept++] = xs[at + static_cast<std::size_t>(std::countr_zero(bits))];
    }
    xs.resize(kept);
}

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif  // per target
