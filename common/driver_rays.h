// Rays that a driver traces over an acceleration structure of its own: VK_KHR_ray_query. A seam
// beside common/backend.h, since the hits are the driver's and follow no rule of ours.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "common/interop/ray.h"
#include "common/scene/mesh.h"
#include "common/scene_queries.h"

namespace mray {

/// Milliseconds of the last call of each kind, by the device's clock if it has one.
struct DriverTimes {
    /// On the host, to write positions and triangles.
    double upload_ms = 0;
    /// A build, an update or a rebuild, that of the one instance included.
    double build_ms = 0;
    double trace_ms = 0;
};

/// The prim_id of a hit that names another mesh than the one there is.
inline constexpr std::uint32_t kNoSuchPrim = 0xFFFFFFFD;

/// One mesh on one device, in scene space. Rays are as every tracer takes them. A prim_id of the
/// driver is passed on as it is and may be any number. Not thread-safe. Calls throw Error: kLimit,
/// kDeviceLost, kInternal.
class DriverRays {
public:
    virtual ~DriverRays() = default;
    DriverRays() = default;
    DriverRays(const DriverRays&) = delete;
    DriverRays& operator=(const DriverRays&) = delete;

    /// Device, driver and version, for reports.
    virtual const std::string& description() const = 0;

    /// Takes a mesh and builds its structure, which update() can change; all other calls need one.
    /// Triangles with a vertex at kInvalidCoordinate are inactive.
    virtual void set_scene(const Topology& topology, std::span<const vec3> positions) = 0;
    /// Takes new positions of the mesh and updates the structure (MODE_UPDATE). Vulkan forbids that
    /// where a vertex becomes valid or invalid: then the structure is built again, and the result
    /// is false.
    virtual bool update(std::span<const vec3> positions) = 0;
    /// Takes new positions of the mesh and builds the structure again, in the memory that it has.
    virtual void rebuild(std::span<const vec3> positions) = 0;

    /// Finds the closest hit hits[i] of rays[i].
    virtual void intersect(std::span<const Ray> rays, std::span<Hit> hits) = 0;
    /// Sets occluded[i] to 1 if rays[i] hits anything, else to 0.
    virtual void occluded(std::span<const Ray> rays, std::span<std::uint8_t> occluded) = 0;
    /// Appends to `lists` the first `most` hits of each ray that the driver offered, in the order
    /// of (t, prim_id), and how many it offered. Repetitions of a triangle are kept.
    virtual void list(std::span<const Ray> rays, std::uint32_t most, HitLists& lists) = 0;

    virtual const DriverTimes& times() const = 0;
};

}  // namespace mray
