// The seam between the program and its tracers, crossed once per image, batch or refit.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <utility>

#include "common/base/errors.h"
#include "common/base/watch.h"
#include "common/bvh/bvh.h"
#include "common/frame_times.h"
#include "common/image/frame.h"
#include "common/image/lit_view.h"
#include "common/interop/ray.h"
#include "common/scene/mesh.h"
#include "common/scene/scene_space.h"
#include "common/scene_queries.h"

namespace mray {

/// Milliseconds and amount of the work of the last call of each kind. A device takes the times of
/// refit and trace from its timestamps, if it has them.
struct BackendTimes {
    /// upload_ms and refit_ms only.
    UpdateTimes update;
    double trace_ms = 0;
    /// Parts of trace_ms that a device measures: rays that start on surfaces, and shading.
    double secondary_ms = 0;
    double shade_ms = 0;
    std::uint64_t rays = 0;
};

class Pose;

/// The part of a tree that a refit writes. The bytes of the refitted tree do not depend on it.
enum class RefitExtent {
    kMoved,  // leaves with a vertex that moved, and the nodes above them
    kAll,    // everything: the cost of a refit when all vertices move
};

/// Changes a tree, and returns whether it did.
using TreeEdit = std::function<bool(Bvh&)>;

struct BackendInfo {
    /// "cpu", "brute" or "vulkan".
    std::string name;
    /// For reports: instruction set and threads, or the device.
    std::string description;
    /// Whether this machine's processor traces, which then takes longer for rays in any order.
    bool is_on_processor = true;
    /// The rays or points that a call should have, if there are so many: calls to a device wait for
    /// each other and take their time.
    std::size_t call_size = 1;
    /// UpdateConfig::first_per_visit: on refitted trees packets of camera rays had 0.0002 (shuffle)
    /// to 0.0007 (orbits) on the CPU, 0.0015 to 0.003 on lavapipe.
    double trace_per_visit = 0.0005;
};

/// Rays in scene space, in any order. One of both answers has their size, the other is empty.
struct RayBatch {
    std::span<const Ray> rays;
    std::span<Hit> hits = {};
    /// 1 for a ray that hits anything, else 0.
    std::span<std::uint8_t> occluded = {};
};

/// Words of a Hit, as bits.
enum HitWords : std::uint32_t { kHitT = 1, kHitU = 2, kHitV = 4, kHitPrim = 8, kWholeHit = 15 };

/// The traced camera rays of the pixels [x0, x1) x [y0, y1) of a view.
struct TracedTile {
    std::size_t view;
    std::uint32_t x0, y0, x1, y1;
    /// At pixel (x0, y0), if the batch has them; the next row is `stride` pixels further on.
    /// The words hit_words of each pixel's hit. t of a miss is infinite without kHitPrim.
    const void* hits = nullptr;
    const std::uint32_t* pixels = nullptr;
    std::size_t stride = 0;
    /// HitWords: at least those of the batch.
    std::uint32_t hit_words = kWholeHit;
};

/// Views of one size with camera rays alone.
struct ViewBatch {
    /// For all views. Its camera is not used: `cameras` has one for each view.
    ImageParams params;
    std::span<const Camera> cameras;
    /// HitWords that are needed.
    std::uint32_t hit_words = kWholeHit;
    bool with_pixels = false;
    /// Takes tiles, which are valid until it returns: one at a time in the threads that trace, or
    /// many in the calling thread.
    std::function<void(std::span<const TracedTile>)> take;
};

/// A backend holds one scene at a time: topology and pose, which it borrows, and a BVH of its own.
/// It uses threads or a device inside. Threads may call trace(), trace_stored(), query() and
/// host_tree() at the same time, and one of them any call that does not change the tree. The
/// backends of gpu/vulkan_backend.h do less. Calls throw Error: kUnavailable, kLimit (before any
/// work), kDeviceLost. A set_scene() that throws may have dropped the scene: then nothing is hit,
/// and refit() and set_tree() throw Error(kBadArgument), until the next set_scene().
class Backend {
public:
    explicit Backend(BackendInfo info) : info_(std::move(info)) {}
    virtual ~Backend() = default;
    Backend(const Backend&) = delete;
    Backend& operator=(const Backend&) = delete;

    const BackendInfo& info() const { return info_; }
    /// Throws Error(kUnavailable) in a forked child, if the device is the parent's alone.
    virtual void require_own_process() const {}

    /// Takes a scene: topology, pose and a tree at the pose. The scene before is dropped. Topology
    /// and pose have to outlive the scene. After each move of the pose call refit() or set_tree()
    /// first; after an assignment to the pose, set_scene().
    virtual void set_scene(const Topology& topology, const Pose& pose, Bvh bvh) = 0;
    /// Takes a tree at the pose, refitted or built elsewhere.
    virtual void set_tree(Bvh bvh) = 0;
    /// Refits the tree to the last move of the pose. A device may leave that to the next call that
    /// needs the tree. Returns the number of leaves that are written: 0 if no vertex moved and the
    /// extent is kMoved.
    virtual std::uint64_t refit(RefitExtent extent = RefitExtent::kMoved) = 0;

    /// The nodes of the tree at the current positions; valid until the next call but finish().
    virtual std::span<const Node> nodes() = 0;
    /// The tree at the current positions, valid until these or the tree change; threads may read
    /// it.
    virtual const Bvh& host_tree() = 0;
    virtual void read_tree(Bvh& bvh) = 0;
    /// Lets `edit` change the tree, in the backend's threads, if it has some. The result must be a
    /// tree over the same triangles at the current positions.
    virtual void edit_tree(const TreeEdit& edit) = 0;

    /// Throws Error(kCancelled) soon after the watch of watch_images() asks for it; the frame then
    /// has any pixels.
    virtual void trace_image(const ImageParams& params, Frame& frame) = 0;
    /// Traces and shades an image, or does nothing and returns false: the caller shades it. Sets
    /// `pixels`, and `linear` unless empty, which only kLit may ask for; hits and occlusion, of all
    /// secondary rays, if `samples` is with_hits. No albedo has kTexturedBit if the kind is kLit.
    /// Throws as trace_image().
    virtual bool trace_lit(const LitView&, Frame& /*samples*/, std::span<std::uint32_t> /*pixels*/,
                           std::span<LinearColour> /*linear*/) {
        return false;
    }
    /// Traces all views together. Throws as trace_image(), after some tiles have been taken.
    virtual void trace_views(const ViewBatch& views) = 0;
    void watch_images(const Watch& watch) { image_watch_ = watch; }
    /// Answers rays; on the CPU a small batch in the calling thread. Returns the milliseconds that
    /// a device took; 0 on the CPU.
    virtual double trace(const RayBatch& batch) = 0;
    /// Finds the closest hits of a tile of rays that start at one point and lie nearly on a grid:
    /// sets hits[y * kStoredTileSide + x] for ray (x, y), whose t is that of the ray's own dir.
    /// Returns false, and sets nothing, if they do not, or if the tracer takes no tiles.
    virtual bool trace_stored(const StoredRayTile&, Hit*) { return false; }
    /// Answers queries about all triangles, on the CPU in the calling thread.
    virtual void query(const QueryBatch& batch) = 0;
    /// Makes ready for queries, is_for_host() or not, so that no thread waits for another one
    /// in query() on the host. Returns BackendInfo::call_size for them.
    virtual std::size_t prepare(bool /*for_host*/) { return info_.call_size; }

    /// Finishes a deferred refit, and returns the times of updates and images.
    virtual const BackendTimes& finish() = 0;

protected:
    const Watch& image_watch() const { return image_watch_; }

private:
    BackendInfo info_;
    Watch image_watch_;
};

}  // namespace mray
