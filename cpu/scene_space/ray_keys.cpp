#include "cpu/scene_space/ray_keys.h"

#include <cassert>
#include <cmath>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "cpu/scene_space/ray_keys.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "common/simd/vectors-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu::HWY_NAMESPACE {
using namespace simd::HWY_NAMESPACE;

#if HWY_TARGET != HWY_SCALAR

/// A row of RayCurve for vectors that hold the two halves of some rays side by side: lane 2 i has a
/// coordinate of the origin of ray i, lane 2 i + 1 one of its direction. `first`: the numbers of
/// the first cells among those of all coordinates.
struct PairedRow {
    FloatVec lower, scale;
    IntVec last, first;
};

HWY_INLINE PairedRow paired_row(const RayCurve& curve, std::size_t org, std::size_t dir) {
    const Mask is_dir = mask_of(0xAAAAAAAAu & kLaneBits);
    const auto pair = [&](auto from_org, auto from_dir) HWY_ATTR {
        return select(is_dir, splat(static_cast<float>(from_dir)),
                      splat(static_cast<float>(from_org)));
    };
    const FloatVec last = pair(curve.last[org], curve.last[dir]);
    const FloatVec first = pair(org * RayCurve::kMostCells, dir * RayCurve::kMostCells);
    return {pair(curve.lower[org], curve.lower[dir]), pair(curve.scale[org], curve.scale[dir]),
            hn::ConvertTo(kInts, last), hn::ConvertTo(kInts, first)};
}

HWY_INLINE UintVec bits_of_cells(const RayCurve& curve, const PairedRow& row, FloatVec at) {
    // Numbers that are not finite become some integer.
    const IntVec cell = hn::ConvertTo(kInts, (at - row.lower) * row.scale);
    const IntVec cut = hn::Min(hn::Max(cell, splat(0)), row.last);
    return hn::GatherIndex(kUints, curve.bits.front().data(), row.first + cut);
}

#endif

void find_keys(const RayCurve& curve, std::span<const StoredRay> rays, std::uint16_t* keys) {
    std::size_t i = 0;
#if HWY_TARGET != HWY_SCALAR
    constexpr std::size_t kRays = kLanes / 2;
    const Mask is_dir = mask_of(0xAAAAAAAAu & kLaneBits);
    const PairedRow rows[] = {paired_row(curve, 0, 3), paired_row(curve, 1, 4)};
    const PairedRow z_row = paired_row(curve, 2, 2);
    for (; i + kRays <= rays.size(); i += kRays) {
        FloatVec v[3], end;
        hn::LoadInterleaved4(kFloats, rays[i].org, v[0], v[1], v[2], end);
        const FloatVec scale = splat(1.0f) / (abs(v[0]) + abs(v[1]) + abs(v[2]));
        const FloatVec x = v[0] * scale;
        const FloatVec y = v[1] * scale;
        const Mask is_below = v[2] < zero();
        const FloatVec a = select(is_below, hn::CopySign(splat(1.0f) - abs(y), x), x);
        const FloatVec b = select(is_below, hn::CopySign(splat(1.0f) - abs(x), y), y);
        const UintVec xy = bits_of_cells(curve, rows[0], select(is_dir, a, v[0])) |
                           bits_of_cells(curve, rows[1], select(is_dir, b, v[1]));
        const UintVec z = bits_of_cells(curve, z_row, v[2]);
        const UintVec key = xy | hn::DupOdd(xy) | z;
        alignas(64) std::uint32_t lanes[kLanes];
        hn::Store(key, kUints, lanes);
        for (std::size_t k = 0; k < kRays; ++k)
            keys[i + k] = static_cast<std::uint16_t>(lanes[2 * k]);
    }
#endif
    for (; i < rays.size(); ++i) {
        const std::array<float, RayCurve::kCoordinates> at = ray_coordinates(rays[i]);
        std::uint32_t key = 0;
        for (std::size_t k = 0; k < at.size(); ++k) {
            const float cell = (at[k] - curve.lower[k]) * curve.scale[k];
            const auto last = static_cast<float>(curve.last[k]);
            // False for NaN.
            const float cut = cell > 0 ? (cell < last ? cell : last) : 0;
            key |= curve.bits[k][static_cast<std::size_t>(cut)];
        }
        keys[i] = static_cast<std::uint16_t>(key);
    }
}

}  // namespace mray::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

#include "common/simd/simd_dispatch-inl.h"

namespace mray::cpu {

HWY_EXPORT(find_keys);

std::array<float, RayCurve::kCoordinates> ray_coordinates(const StoredRay& ray) {
    const float* dir = ray.dir;
    const float scale = 1 / (std::abs(dir[0]) + std::abs(dir[1]) + std::abs(dir[2]));
    const float x = dir[0] * scale;
    const float y = dir[1] * scale;
    const bool is_below = dir[2] < 0;
    return {ray.org[0], ray.org[1], ray.org[2], is_below ? std::copysign(1 - std::abs(y), x) : x,
            is_below ? std::copysign(1 - std::abs(x), y) : y};
}

void find_ray_keys(const RayCurve& curve, const SimdTarget& target, std::span<const StoredRay> rays,
                   std::span<std::uint16_t> keys) {
    assert(rays.size() == keys.size());
    SIMD_FUNCTION(find_keys, target)(curve, rays, keys.data());
}

}  // namespace mray::cpu

#endif  // HWY_ONCE
