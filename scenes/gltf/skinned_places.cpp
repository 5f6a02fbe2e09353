#include "scenes/gltf/skinned_places.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "scenes/gltf/skinned_places.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "scenes/gltf/skinned_places-inl.h"

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
