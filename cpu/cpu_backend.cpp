#include "cpu/cpu_backend.h"

#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include "common/base/thread_arena.h"
#include "common/simd/simd_target.h"
#include "common/update/refit_plan.h"
#include "cpu/image/tile_tracer.h"
#include "cpu/queries/tree_queries.h"
#include "cpu/reference/scalar_tracer.h"
#include "cpu/refit/refit.h"

namespace mray::cpu {
namespace {

// As many rays as streams are made of (cpu/single_ray/ray_stream-inl.h), or fewer for more threads.
constexpr std::size_t kRayGrain = 2048;

const Topology kNoTopology;
const Pose kNoPose;

struct Tracers {
    std::unique_ptr<ImageTracer> image;
    std::function<void(const QueryBatch&)> query;
};

/// Makes the tracers of a scene, whose arrays outlive them.
using MakeTracers =
    std::function<Tracers(const Topology&, std::span<const vec3> positions, const Bvh&)>;

/// Scene, threads, refits and timing, the same for every CPU tracer.
class TracerBackend final : public Backend {
public:
    TracerBackend(std::string name, const std::string& how, const SimdTarget& target,
                  std::unique_ptr<ThreadArena> arena, MakeTracers make_tracers)
        : Backend({.name = std::move(name),
                   .description = fmt::format("{}, {} threads", how, arena->threads())}),
          target_(target),
          arena_(std::move(arena)),
          make_tracers_(std::move(make_tracers)),
          tracers_(make_tracers_(*topology_, pose_->positions(), bvh_)) {}

    void set_scene(const Topology& topology, const Pose& pose, Bvh bvh) override {
        topology_ = &topology;
        pose_ = &pose;
        set_tree(std::move(bvh));
        // Until the next scene arrays of pose and tree may change, not their places.
        tracers_ = make_tracers_(topology, pose.positions(), bvh_);
    }

    void set_tree(Bvh bvh) override {
        const Stopwatch watch;
        bvh_ = std::move(bvh);
        block_leaves_.reset();
        times_ = {.update = {.upload_ms = watch.ms()}};
    }

    std::uint64_t refit(RefitExtent extent) override {
        const Stopwatch watch;
        const RefitPlan plan = plan_refit(bvh_, *pose_, extent, block_leaves_);
        arena_->execute([&] {
            cpu::refit(bvh_, pose_->positions(), target_, plan.all ? nullptr : &plan.parts);
        });
        times_ = {.update = {.refit_ms = watch.ms()}};
        return plan.leaf_count;
    }

    std::span<const Node> nodes() override { return bvh_.nodes; }

    const Bvh& host_tree() override { return bvh_; }
    void read_tree(Bvh& bvh) override { bvh = bvh_; }

    void edit_tree(const TreeEdit& edit) override {
        if (arena_->execute([&] { return edit(bvh_); })) block_leaves_.reset();
    }

    void trace_image(const ImageParams& params, Frame& frame) override {
        const std::size_t pixels = std::size_t{params.width} * params.height;
        frame.width = params.width;
        frame.height = params.height;
        const Watch& caller = image_watch();
        resize_watched(frame.hits, pixels, caller);
        resize_watched(frame.occlusion, pixels, caller);
        resize_watched(frame.pixels, frame.with_pixels ? pixels : 0, caller);
        const ShadedMesh mesh{topology_, pose_->positions()};
        const ImageTiles tiles = tiles_for(params, 1);
        std::atomic<std::uint64_t> secondary = 0;
        for_each_tile(tiles.count(), [&](std::size_t i) {
            const Tile tile = tiles[static_cast<std::uint32_t>(i)];
            secondary += tracers_.image->trace_tile(mesh, params, tile, frame, caller);
        });
        times_.rays = pixels + secondary;
    }

    void trace_views(const ViewBatch& views) override {
        const ShadedMesh mesh{topology_, pose_->positions()};
        const ImageTiles tiles = tiles_for(views.params, views.cameras.size());
        for_each_tile(tiles.count() * views.cameras.size(), [&](std::size_t i) {
            trace_tile_of(views, i / tiles.count(),
                          tiles[static_cast<std::uint32_t>(i % tiles.count())], mesh);
        });
        times_.rays =
            std::uint64_t{views.params.width} * views.params.height * views.cameras.size();
    }

    double trace(const RayBatch& batch) override {
        using Range = tbb::blocked_range<std::size_t>;
        const auto trace_range = [&](const Range& r) {
            const std::span<const Ray> rays = batch.rays.subspan(r.begin(), r.size());
            if (batch.occluded.empty()) {
                tracers_.image->intersect(rays, batch.hits.subspan(r.begin(), r.size()));
            } else {
                tracers_.image->occluded(rays, batch.occluded.subspan(r.begin(), r.size()));
            }
        };
        const Range all(0, batch.rays.size(), kRayGrain);
        if (batch.rays.size() <= kRayGrain) {
            trace_range(all);
        } else {
            arena_->execute([&] { tbb::parallel_for(all, trace_range); });
        }
        return 0;
    }

    bool trace_stored(const StoredRayTile& tile, Hit* hits) override {
        return tracers_.image->intersect_stored(tile, hits);
    }

    void query(const QueryBatch& batch) override { tracers_.query(batch); }

    const BackendTimes& finish() override { return times_; }

private:
    /// The largest that packets are made of, but where these are few for the threads.
    ImageTiles tiles_for(const ImageParams& params, std::size_t views) const {
        constexpr std::size_t kTilesAThread = 4;
        const ImageTiles tiles(params.width, params.height, kCameraSide);
        if (views * tiles.count() >= kTilesAThread * static_cast<std::size_t>(arena_->threads()))
            return tiles;
        return {params.width, params.height, kCameraSide / 2};
    }

    /// Calls trace(i) for tiles in parallel, until the caller cancels; sets the time.
    template <class Trace>
    void for_each_tile(std::size_t count, Trace trace) {
        const Watch& caller = image_watch();
        const Stopwatch watch;
        arena_->execute([&] {
            tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) {
                caller.throw_if_cancelled();
                trace(i);
                caller.advance(1.0 / static_cast<double>(count));
            });
        });
        times_.trace_ms = watch.ms();
    }

    /// Traces a tile and hands it over at once, while its hits are in the caches.
    void trace_tile_of(const ViewBatch& views, std::size_t view, const Tile& tile,
                       const ShadedMesh& mesh) {
        ImageParams params = views.params;
        params.camera = views.cameras[view];
        Frame& frame = view_frames_.local();
        TracedTile traced{view, tile.x0, tile.y0, tile.x1, tile.y1};
        if (views.with_pixels) {
            const std::size_t pixels = std::size_t{params.width} * params.height;
            frame.hits.resize(pixels);
            frame.occlusion.resize(pixels);
            frame.pixels.resize(pixels);
            tracers_.image->trace_tile(mesh, params, tile, frame, image_watch());
            const std::size_t first = std::size_t{tile.y0} * params.width + tile.x0;
            traced.hits = &frame.hits[first];
            traced.pixels = &frame.pixels[first];
            traced.stride = params.width;
        } else {
            frame.hits.resize(kCameraSide * kCameraSide);
            tracers_.image->intersect_camera(params, tile, frame.hits.data(), kCameraSide,
                                             image_watch());
            traced.hits = frame.hits.data();
            traced.stride = kCameraSide;
        }
        views.take({&traced, 1});
    }

    SimdTarget target_;
    std::unique_ptr<ThreadArena> arena_;
    MakeTracers make_tracers_;
    const Topology* topology_ = &kNoTopology;
    const Pose* pose_ = &kNoPose;
    Bvh bvh_;
    std::optional<BlockLeaves> block_leaves_;
    Tracers tracers_;
    /// For each thread: the hits of a tile, or a frame of a view if pixels are wanted.
    tbb::enumerable_thread_specific<Frame> view_frames_;
    BackendTimes times_;
};

std::unique_ptr<Backend> make_portable(std::string name, const CpuConfig& config,
                                       MakeTracers make_tracers) {
    return std::make_unique<TracerBackend>(
        std::move(name), "portable C++", find_simd_target("scalar"),
        std::make_unique<ThreadArena>(config.threads), std::move(make_tracers));
}

}  // namespace

std::unique_ptr<Backend> make_cpu_backend(const CpuConfig& config) {
    if (config.simd == kSimdOff) return make_scalar_backend(config);
    const SimdTarget target = find_simd_target(config.simd);
    return std::make_unique<TracerBackend>(
        "cpu", target.name, target, std::make_unique<ThreadArena>(config.threads),
        [target](const Topology&, std::span<const vec3>, const Bvh& bvh) -> Tracers {
            return {std::make_unique<TileTracer>(bvh, target), TreeQueries(bvh, target)};
        });
}

std::unique_ptr<Backend> make_scalar_backend(const CpuConfig& config) {
    return make_portable("cpu", config,
                         [](const Topology&, std::span<const vec3>, const Bvh& bvh) -> Tracers {
                             return {std::make_unique<OneByOne<ScalarTracer>>(ScalarTracer(bvh)),
                                     TreeQueries(bvh, find_simd_target("scalar"))};
                         });
}

std::unique_ptr<Backend> make_brute_backend(const CpuConfig& config) {
    return make_portable(
        "brute", config,
        [](const Topology& topology, std::span<const vec3> positions, const Bvh&) -> Tracers {
            return {std::make_unique<OneByOne<BruteTracer>>(BruteTracer(topology, positions)),
                    BruteTracer(topology, positions)};
        });
}

}  // namespace mray::cpu
