// Rays in the memory of a caller.
#pragma once

#include <cstddef>
#include <cstdint>

#include "common/interop/platform.h"

namespace mray {

/// A ray in the caller's own space: org + t * dir for t > 0 in [tnear, tfar].
struct StoredRay {
    float org[3];
    float tnear;
    float dir[3];
    float tfar;
};
static_assert(sizeof(StoredRay) == 32);

/// The sides of a tile of stored rays are multiples of kStoredTileStep, up to kStoredTileSide.
inline constexpr std::uint32_t kStoredTileStep = 8;
inline constexpr std::uint32_t kStoredTileSide = 64;

/// Ray (x, y) is rays[y * stride + x]. All may start at one point, which is `org` in scene space.
struct StoredRayTile {
    const StoredRay* rays;
    std::size_t stride;
    std::uint32_t width;
    std::uint32_t height;
    vec3 org;
};

}  // namespace mray
