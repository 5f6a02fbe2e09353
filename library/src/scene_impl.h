// What a scene is made of, for the members of Scene.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <span>

#include "common/backend.h"
#include "common/base/watch.h"
#include "common/frame_times.h"
#include "common/image/frame.h"
#include "common/scene/camera_setup.h"
#include "common/scene/vertex_normals.h"
#include "common/update/policy.h"
#include "common/update/tree_updater.h"
#include "cpu/image/lit_shader.h"
#include "library/src/device_impl.h"
#include "library/src/ray_order.h"
#include "library/src/ray_space.h"
#include "library/src/scene/errors.h"
#include "library/src/scene/mesh_list.h"
#include "library/src/scene/pose_reader.h"
#include "morphray/images.hpp"
#include "morphray/scene.hpp"

namespace morphray::detail {

/// The cost of a scene's queries since the last update, for policies. Threads may add at the same
/// time. Rays are counted exactly, for deterministic policies.
class QueryCost {
public:
    void add(double ms, std::uint64_t rays) {
        add_time(ms);
        count_rays(rays);
    }
    /// Calls `query`, which traces this many rays. A clock costs as much as a ray, so of small
    /// calls one in some kSample rays of this thread is timed.
    template <class Query>
    void measure(std::uint64_t rays, Query query) {
        constexpr std::uint64_t kSample = 64;
        const std::uint64_t count = count_rays(rays);
        if (count / kSample == (count - rays) / kSample) {
            query();
            return;
        }
        const mray::Stopwatch watch;
        query();
        const double shown = static_cast<double>(std::max(rays, kSample));
        add_time(watch.ms() * (shown / static_cast<double>(rays)));
    }

    double ms() const {
        return static_cast<double>(nanoseconds_.load(std::memory_order_relaxed)) * 1e-6;
    }
    /// No other thread may add at the same time.
    std::uint64_t rays() const { return counted() - counted_before_; }
    /// As rays().
    void reset() {
        nanoseconds_ = 0;
        counted_before_ = counted();
    }

private:
    struct alignas(64) Counter {
        std::atomic<std::uint64_t> rays = 0;
    };
    static constexpr std::size_t kCounters = 64;

    void add_time(double ms) {
        nanoseconds_.fetch_add(static_cast<std::uint64_t>(ms * 1e6), std::memory_order_relaxed);
    }
    /// Returns the number of rays in this thread's counter, these included.
    std::uint64_t count_rays(std::uint64_t rays) {
        // Threads that share a cache line would wait for each other.
        static constinit std::atomic<std::size_t> threads = 0;
        thread_local const std::size_t index =
            threads.fetch_add(1, std::memory_order_relaxed) % kCounters;
        return counters_[index].rays.fetch_add(rays, std::memory_order_relaxed) + rays;
    }
    std::uint64_t counted() const {
        std::uint64_t sum = 0;
        for (const Counter& counter : counters_)
            sum += counter.rays.load(std::memory_order_relaxed);
        return sum;
    }

    std::atomic<std::uint64_t> nanoseconds_ = 0;
    /// counted() at the last reset(). Counters go on, to sample few queries a pose, too.
    std::uint64_t counted_before_ = 0;
    std::array<Counter, kCounters> counters_;
};

/// The results of a backend for an image. The next image may use their memory again.
struct TracedImage {
    /// Of the samples: width and height are those of the image times a pixel's side.
    mray::ImageParams params = {};
    mray::Frame samples;
    /// The same samples with ambient-occlusion rays, if `has_sky`; else those of an image before.
    mray::Frame sky;
    bool has_sky = false;
};

class SceneImpl {
public:
    /// Has no backend yet: start() makes them.
    SceneImpl(const Device& on, const SceneOptions& with, const PoseReader& at)
        : device(on), options(with), pose(at), shader(target()) {}

    /// Reads the positions of the list of meshes, as PoseReader::read_list().
    std::vector<mray::IndexRange> read_list();
    /// Hands the meshes to the device with a tree, which is built if there is none.
    void start(const mray::Bvh* tree);
    /// The pose has been read: what was made of the one before is dropped.
    void took_pose();
    /// Makes the changes of the list of meshes, and brings the tree to them.
    void change_meshes();
    void follow(std::span<const PoseReader::Piece> pieces);
    void require_usable() const {
        tracer->require_own_process();
        if (broken) throw *broken;
    }

    /// The tree at the pose. It is read from a device once a pose, with the scene's mutex locked.
    const mray::Bvh& tree() {
        if (const mray::Bvh* const on_host = tracer->host_tree()) return *on_host;
        if (!pose_tree) tracer->read_tree(pose_tree.emplace());
        return *pose_tree;
    }

    const mray::SimdTarget& target() const { return DeviceImpl::of(device).simd_target(); }
    mray::ThreadArena& arena() { return DeviceImpl::of(device).arena(); }

    Device device;
    SceneOptions options;
    MeshList meshes;
    PoseReader pose;
    /// That of the pose, once the scene has started.
    std::optional<RaySpace> space;
    std::unique_ptr<mray::Backend> tracer;
    std::unique_ptr<mray::TreeUpdater> updater;
    double read_ms = 0;
    std::vector<LeftOut> left_out;

    std::atomic<bool> is_changing = false;
    /// Why the scene is of no use any more.
    std::optional<Error> broken;
    QueryCost cost;

    /// Guards in const members what follows, `updater`, and a tracer that answers no threads.
    std::mutex mutex;
    mray::cpu::LitShader shader;
    /// Those of the meshes, and whether they are those of the pose.
    std::optional<mray::VertexNormals> normals;
    bool has_normals = false;
    /// Those of the meshes, once they are asked for.
    std::optional<EdgeCounts> edge_counts;
    /// The memory of the image before.
    TracedImage spare;

    /// There if it was read.
    std::optional<mray::Bvh> pose_tree;

    /// Guards `sorter`.
    std::mutex sorter_mutex;
    RaySorter sorter;
};

/// Throws Error if the Scene has been moved from.
inline SceneImpl& require(const std::unique_ptr<SceneImpl>& impl) {
    if (impl == nullptr) throw_bad_argument("this scene has been moved from");
    return *impl;
}

/// Throws Error unless there is room for as many answers.
inline void require_room(std::size_t questions, const char* what, std::size_t answers) {
    if (questions == answers) return;
    throw_bad_argument("{} {}, but room for {} answers", questions, what, answers);
}

/// Calls work(scene) for a scene that can be used; whatever goes wrong comes out as a public Error.
template <class Work>
decltype(auto) with_scene(const std::unique_ptr<SceneImpl>& impl, Work work) {
    return with_public_errors([&]() -> decltype(auto) {
        SceneImpl& scene = require(impl);
        scene.require_usable();
        return work(scene);
    });
}

/// The first submission where the caller may cancel: a workgroup.
inline constexpr std::size_t kLeastDeviceRun = 64;

/// Calls work(first, part, order) for parts of the rays from `first` on, until it is cancelled. If
/// `sorts` and that pays, `order` has places in an order in which neighbours are alike.
template <class Work>
void for_ordered_parts(SceneImpl& scene, std::span<const Ray> rays, bool sorts, std::size_t most,
                       mray::ThreadArena* arena, mray::Watch watch, Work work) {
    constexpr std::size_t kLeastSorted = 8192;
    sorts &= rays.size() >= kLeastSorted && scene.tracer->info().is_on_processor;
    std::unique_lock lock(scene.sorter_mutex, std::defer_lock);
    std::optional<RaySorter> own;
    RaySorter* sorter = nullptr;
    if (sorts) {
        sorter = lock.try_lock() ? &scene.sorter : &own.emplace();
        sorter->choose_curve(rays, scene.space->extent());
    }
    for_runs_of(
        0, rays.size(), watch,
        [&](std::size_t first, std::size_t count) {
            const std::span<const Ray> part = rays.subspan(first, count);
            std::span<const std::uint32_t> order;
            if (sorter != nullptr) order = sorter->sort(part, scene.target(), arena);
            work(first, part, order);
        },
        most);
}

/// Calls ask(first, count) for parts of [0, total), on a device in turn. On the host it asks the
/// watch itself. Throws Error(kCancelled).
template <class Ask>
void ask_in_parts(SceneImpl& scene, std::size_t total, const QueryOptions& options, Ask ask) {
    // Enough for streams of each octant of directions.
    constexpr std::size_t kHostBatch = 2048;
    constexpr std::size_t kDeviceBatch = std::size_t{1} << 16;
    const mray::Watch watch(options.cancel);
    if (scene.tracer->info().answers_threads) {
        mray::ThreadArena* const arena =
            options.threads == Threads::calling ? nullptr : &scene.arena();
        scene.cost.measure(total, [&] { for_each_run(arena, total, {}, ask, kHostBatch); });
    } else {
        const mray::Stopwatch stopwatch;
        const auto ask_alone = [&](std::size_t first, std::size_t count) {
            const std::scoped_lock lock(scene.mutex);
            ask(first, count);
        };
        for_runs_of(0, total, watch, ask_alone, kDeviceBatch, kLeastDeviceRun);
        scene.cost.add(stopwatch.ms(), total);
    }
    watch.throw_if_cancelled();
}

// Images (library/src/image/).

/// Brings the normals of vertices to the pose; the scene's mutex is locked.
void update_normals(SceneImpl& scene);

/// A view relative to the origin.
mray::ViewSpec to_spec(const View& view, const Point& origin);

/// Traces and shades a view at the pose, in the CPU's shader for all backends; the scene's mutex is
/// locked. Throws Error(bad_argument) for other numbers of samples than View::samples allows.
void render_lit(SceneImpl& scene, const View& view, const mray::Watch& watch, TracedImage& traced,
                Image& image);

// The passes of render_lit() that trace. Both return their number of rays; they may be cancelled.

/// Makes of an image without holes that of a trace through them. A hit in a hole is followed by the
/// next hit of its ray: camera rays first, then shadow rays and rays of the sky.
std::uint64_t apply_alpha_test(SceneImpl& scene, const mray::Watch& watch, TracedImage& image);

/// Takes from an image of shadow rays those shadows that only the flatness of triangles makes. A
/// sample in shadow whose smooth normal faces the light is asked again from the smooth surface
/// above it (smooth_surface() of common/interop/lit.h), and is in the light if nothing lies between
/// the light and that point, nor between that point and the triangle. `shadows` are those of
/// `samples`, which have normal_ids.
std::uint64_t light_smooth_surfaces(SceneImpl& scene, const mray::Watch& watch,
                                    const mray::cpu::LitSamples& samples,
                                    std::span<std::uint32_t> shadows);

}  // namespace morphray::detail
