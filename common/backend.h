// The seam between the program and what traces: called once per image, batch or refit, never per
// ray.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "common/bvh/bvh.h"
#include "common/image/frame.h"
#include "common/scene/mesh.h"
#include "common/scene/pose.h"
#include "common/update/restructure.h"

namespace morphray {

/// Wall time of the last call of each kind, in milliseconds, and what it did. On a device the times
/// of refit and trace are taken from its timestamps where it has them.
struct BackendTimes {
    double upload_ms = 0;
    double refit_ms = 0;
    double trace_ms = 0;
    /// Parts of trace_ms that a device tells apart: rays that start on surfaces, and shading.
    double secondary_ms = 0;
    double shade_ms = 0;
    std::uint64_t rays = 0;
    /// Leaves that the last refit wrote: 0 when no vertex had moved.
    std::uint64_t refitted_leaves = 0;
    /// Bytes of the tree that the last set_scene(), set_frame() or restructure() wrote to a device.
    std::uint64_t tree_bytes = 0;
};

/// What a refit looks at. The bytes of the tree are the same either way.
enum class RefitExtent {
    kMoved,  // what the vertices that moved reach
    kAll,    // everything: what a refit costs when all moves, or the tree is not that of the pose
};

/// A backend holds one scene at a time: topology, positions and a BVH of its own. Not thread-safe;
/// it uses threads or a device inside. Calls throw Error: kUnavailable, kLimit (before any work),
/// kDeviceLost.
class Backend {
public:
    virtual ~Backend() = default;

    /// "cpu", "brute" or "vulkan".
    virtual const std::string& name() const = 0;
    /// What it runs on, for reports: instruction set and threads, or the device.
    virtual std::string description() const = 0;

    /// Takes a scene: topology, positions in scene space, and a tree over them. Everything of an
    /// earlier scene is dropped.
    virtual void set_scene(const Topology& topology, std::span<const vec3> positions,
                           const Bvh& bvh) = 0;
    /// New positions, with a tree that belongs to them (refitted or built elsewhere).
    virtual void set_frame(std::span<const vec3> positions, const Bvh& bvh) = 0;
    /// New positions; the backend refits its own tree to them, and may leave that to the next call
    /// that needs the tree, for a device to do with it in one go. Returns how many leaves it
    /// writes.
    virtual std::uint64_t refit(std::span<const vec3> positions,
                                RefitExtent extent = RefitExtent::kMoved) = 0;
    /// Whether it interpolates keyframes itself, so that refit_to() a pose that has them can do
    /// without its positions. Of the scene that it has.
    virtual bool interpolates() const { return false; }
    /// refit() to a pose's positions, or to what its keyframes give: the same bits. The keyframes
    /// must outlive the scene.
    virtual std::uint64_t refit_to(Pose& pose, RefitExtent extent = RefitExtent::kMoved) {
        return refit(pose.positions(), extent);
    }
    /// tree_cost() of its tree as it is.
    virtual double tree_cost() = 0;
    /// restructure() on its own tree at the pose that it has. Returns what that does.
    virtual std::size_t restructure(const Topology& topology, double growth, BuiltAreas& areas) = 0;
    /// Copies the backend's tree.
    virtual void read_bvh(Bvh& bvh) = 0;

    virtual void trace_image(const ImageParams& params, Frame& frame) = 0;
    /// Likewise, but the frame, which must outlive this, may be whole only after the next call of
    /// anything but refit(): meanwhile the next pose can be made and handed over.
    virtual void begin_image(const ImageParams& params, Frame& frame) {
        trace_image(params, frame);
    }
    /// Waits for what refit() and begin_image() have left to be done.
    virtual void finish() {}
    /// hits[i] answers rays[i] (closest hit); any rays, any order.
    virtual void trace_rays(std::span<const Ray> rays, std::span<Hit> hits) = 0;

    /// After finish().
    virtual const BackendTimes& times() = 0;
};

}  // namespace morphray
