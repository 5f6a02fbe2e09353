// The vertices of a leaf in the projection of a packet.

#if defined(MORPHRAY_CPU_PACKET_PACKET_VERTICES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_PACKET_PACKET_VERTICES_INL_H
#undef MORPHRAY_CPU_PACKET_PACKET_VERTICES_INL_H
#else
#define MORPHRAY_CPU_PACKET_PACKET_VERTICES_INL_H
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "common/interop/bvh_layout.h"
#include "cpu/packet/packet.h"
#include "cpu/simd/fast_hit_rule-inl.h"

HWY_BEFORE_NAMESPACE();
namespace morphray::cpu {
namespace HWY_NAMESPACE {

/// The triangles of a leaf whose vertices are all finite.
inline std::uint32_t finite_triangles(const Leaf& leaf) {
    std::uint32_t finite = 0;
    for (std::uint32_t i = 0; i < kLeafTriangles; ++i) {
        float largest = -kSceneExtent;
        for (std::uint32_t k = 0; k < 3; ++k)
            largest = std::max(largest, leaf.vertex[corner(leaf.vertex[i].corners, k)].x);
        finite |= (largest <= kSceneExtent ? 1u : 0u) << i;
    }
    return finite;
}

/// A leaf's vertices in a packet's projection, the largest of their coordinates relative to the
/// first one in scene space, the corners that they hold, and the largest coordinate of the first
/// one relative to the origin; how far off: TriangleSetup. A vertex that is not finite is put where
/// the first is. Returns whether all are finite.
HWY_INLINE bool project_vertices(const PacketFrame& frame, const Leaf& leaf, float* vx, float* vy,
                                 float* vz, float* sizes, std::uint32_t* corners, float& distance) {
    // A vertex that is not finite is put where v0 is: its triangles are left out afterwards.
    const LeafVertex* first = leaf.vertex;
    while (first->x > kSceneExtent && first != leaf.vertex + kLeafVertices - 1) ++first;
    const LeafVertex& v0 = *first;
    const double p[3] = {double{v0.x} - frame.org.x, double{v0.y} - frame.org.y,
                         double{v0.z} - frame.org.z};
    distance =
        static_cast<float>(std::max(std::abs(p[0]), std::max(std::abs(p[1]), std::abs(p[2]))));
    float h[3];
    for (int k = 0; k < 3; ++k) {
        h[k] = static_cast<float>(frame.rows[k][0] * p[0] + frame.rows[k][1] * p[1] +
                                  frame.rows[k][2] * p[2]);
    }
    float* const out[3] = {vx, vy, vz};
    bool all_finite = true;
    for (std::size_t l = 0; l < kLeafVertices; l += kLanes) {
        FloatVec x, y, z, w;
        hn::LoadInterleaved4(kFloats, &leaf.vertex[l].x, x, y, z, w);
        store(as_uint(w), corners + l);
        const Mask finite = x <= splat(kSceneExtent);
        all_finite &= all(finite);
        x = zero_unless(finite, x - splat(v0.x));
        y = zero_unless(finite, y - splat(v0.y));
        z = zero_unless(finite, z - splat(v0.z));
        store(max(abs(x), max(abs(y), abs(z))), sizes + l);
        for (int k = 0; k < 3; ++k) {
            const float* row = frame.rows_f[k];
            const FloatVec sum =
                mul_add(splat(row[0]), x, mul_add(splat(row[1]), y, splat(row[2]) * z));
            store(sum + splat(h[k]), out[k] + l);
        }
    }
    return all_finite;
}

}  // namespace HWY_NAMESPACE
}  // namespace morphray::cpu
HWY_AFTER_NAMESPACE();

#endif
