// Rays that threads may ask a backend's scene at the same time.
#pragma once

#include <cstdint>
#include <span>

#include "common/interop/ray.h"
#include "common/scene/stored_rays.h"

namespace mray {

/// Queries of the scene that a backend holds, in scene space. Threads may call them at the same
/// time, but not during a call of the backend that changes its scene. They run in the calling
/// thread and do not change Backend::finish().
class RayQueries {
public:
    virtual ~RayQueries() = default;

    /// Finds the closest hit hits[i] of rays[i]; any rays, in any order.
    virtual void intersect(std::span<const Ray> rays, std::span<Hit> hits) const = 0;
    /// Sets occluded[i] to 1 if rays[i] hits anything, else to 0; any rays, in any order.
    virtual void occluded(std::span<const Ray> rays, std::span<std::uint8_t> occluded) const = 0;
    /// Finds the closest hits of a tile of rays that start at one point and lie nearly on a grid:
    /// sets hits[y * kStoredTileSide + x] for ray (x, y), whose t is that of the ray's own dir.
    /// Returns false, and sets nothing, if they do not, or if the tracer takes no tiles.
    virtual bool intersect_tile(const StoredRayTile& tile, Hit* hits) const = 0;
};

}  // namespace mray
