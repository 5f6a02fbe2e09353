// Skinning, compiled once for each target.
#include "scenes/gltf/pose.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "scenes/gltf/skinned_places.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace mray::gltf {
namespace HWY_NAMESPACE {

/// Four doubles, in one register or in two: arithmetic that no target may fuse.
using Double4 = double __attribute__((vector_size(4 * sizeof(double)), may_alias));

/// The fourth component of a place is 1, that of the sum the sum of the weights.
template <class Real, class PerVertex>
inline void place_all(const SkinnedVertices& vertices, const Real* p, PerVertex per_vertex,
                      vec3* out) {
    const std::uint16_t* joint = vertices.joints;
    const float* weight = vertices.weights;
    const std::size_t joint_count = per_vertex;
    for (std::size_t i = 0; i < vertices.count; ++i) {
        const double x = static_cast<double>(p[3 * i]);
        const double y = static_cast<double>(p[3 * i + 1]);
        const double z = static_cast<double>(p[3 * i + 2]);
        Double4 sum = {0, 0, 0, 0};
#pragma GCC unroll 4
        for (std::size_t k = 0; k < joint_count; ++k) {
            const auto* const column =
                reinterpret_cast<const Double4*>(vertices.maps[joint[k]].column);
            const Double4 place = column[0] * x + column[1] * y + column[2] * z + column[3];
            sum += place * static_cast<double>(weight[k]);
        }
        joint += joint_count;
        weight += joint_count;
        const double total = sum[3];
        sum /= Double4{total, total, total, total};
        out[i] = {static_cast<float>(sum[0]), static_cast<float>(sum[1]),
                  static_cast<float>(sum[2])};
    }
}

template <class Real>
inline void place_all(const SkinnedVertices& vertices, const Real* positions, vec3* out) {
    if (vertices.per_vertex == 4) {
        place_all(vertices, positions, std::integral_constant<std::size_t, 4>(), out);
    } else {
        place_all(vertices, positions, vertices.per_vertex, out);
    }
}

inline void place_skinned(const SkinnedVertices& vertices, vec3* out) {
    if (vertices.morphed != nullptr) {
        place_all(vertices, vertices.morphed, out);
    } else {
        place_all(vertices, &vertices.positions->x, out);
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace mray::gltf
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

#include "common/simd/simd_dispatch-inl.h"

namespace mray::gltf {
namespace {

HWY_EXPORT(place_skinned);

}  // namespace

PlaceSkinned place_skinned_on(const SimdTarget& target) {
    return SIMD_FUNCTION(place_skinned, target);
}

}  // namespace mray::gltf

#endif
