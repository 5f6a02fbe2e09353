// Skinning, compiled once for each target.
#if defined(MORPHRAY_COMMON_SCENE_FORMATS_GLTF_MOTION_SKINNED_PLACES_INL_H) == \
    defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_COMMON_SCENE_FORMATS_GLTF_MOTION_SKINNED_PLACES_INL_H
#undef MORPHRAY_COMMON_SCENE_FORMATS_GLTF_MOTION_SKINNED_PLACES_INL_H
#else
#define MORPHRAY_COMMON_SCENE_FORMATS_GLTF_MOTION_SKINNED_PLACES_INL_H
#endif

#include <cstddef>

#include "common/scene/formats/gltf/motion/skinned_places.h"

HWY_BEFORE_NAMESPACE();
namespace mray::gltf {
namespace HWY_NAMESPACE {

/// Four doubles, in one register or in two: arithmetic that no target may fuse.
using Double4 = double __attribute__((vector_size(4 * sizeof(double)), may_alias));

/// A vertex is the mean of its places under its joints. The fourth component of each place is 1, so
/// that of the sum is the sum of the weights.
inline void place_skinned(const SkinnedVertices& vertices, vec3* out) {
    const std::uint16_t* joint = vertices.joints;
    const float* weight = vertices.weights;
    for (std::size_t i = 0; i < vertices.count; ++i) {
        const double* const p = vertices.positions + 3 * i;
        Double4 sum = {0, 0, 0, 0};
        for (std::size_t k = 0; k < vertices.per_vertex; ++k) {
            const auto* const column =
                reinterpret_cast<const Double4*>(vertices.maps[*joint++].column);
            const Double4 place =
                column[0] * p[0] + column[1] * p[1] + column[2] * p[2] + column[3];
            sum += place * static_cast<double>(*weight++);
        }
        const double total = sum[3];
        sum /= Double4{total, total, total, total};
        out[i] = {static_cast<float>(sum[0]), static_cast<float>(sum[1]),
                  static_cast<float>(sum[2])};
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace mray::gltf
HWY_AFTER_NAMESPACE();

#endif
