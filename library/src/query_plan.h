// How the rays and points of a call are divided: among threads, into calls of the tracer, and in
// which order; the triangles that exist for them, and the parts in scene space that are asked about
// together.
#pragma once

#include <tbb/blocked_range.h>

#include <cmath>

#include "common/watched_runs.h"
#include "library/src/scene_impl.h"

namespace morphray::detail {

/// Batches up to this size are traced in the calling thread; waking other threads takes longer.
inline constexpr std::size_t kFewRays = 256;
/// Rays that are converted and traced together, in memory on the stack.
inline constexpr std::size_t kRun = mray::cpu::SceneRays::kMost;

/// Calls work(first, count) for runs of at most `most` of the rays [begin, end), until the watch is
/// cancelled. If it can be, the first run of a thread is half a stream.
template <class Work>
void for_runs_of(std::size_t begin, std::size_t end, mray::Watch watch, Work work,
                 std::size_t most = kRun) {
    constexpr std::size_t kLeastRun = 32;
    mray::for_watched_runs(begin, end, watch, most, kLeastRun, work);
}

/// As for_runs_of(0, total, ...), in many threads unless `arena` is null or rays are few.
template <class Work>
void for_each_run(mray::ThreadArena* arena, std::size_t total, mray::Watch watch, Work work,
                  std::size_t most = kRun) {
    if (arena == nullptr || total <= kFewRays) return for_runs_of(0, total, watch, work, most);
    using RayRange = tbb::blocked_range<std::size_t>;
    arena->execute([&] {
        tbb::parallel_for(RayRange(0, total, kRun), [&](const RayRange& range) {
            for_runs_of(range.begin(), range.end(), watch, work, most);
        });
    });
}

/// Calls work(first, rays, order) for batches of the rays from `first` on, until it is cancelled.
/// If the caller says that they come in any order, and sorting pays, `order` numbers the rays of
/// the batch so that neighbours are alike.
template <class Work>
void for_ordered_batches(SceneImpl& scene, std::span<const Ray> rays, const QueryOptions& options,
                         std::size_t most, mray::ThreadArena* arena, Work work) {
    constexpr std::size_t kLeastSorted = 8192;
    const auto run = [&](RaySorter* sorter) {
        const auto work_on = [&](std::size_t first, std::size_t count) {
            const std::span<const Ray> batch = rays.subspan(first, count);
            std::span<const std::uint32_t> order;
            if (sorter != nullptr) order = sorter->sort(batch, scene.target(), arena);
            work(first, batch, order);
        };
        mray::for_watched_runs(0, rays.size(), mray::Watch(options.cancel), most, 0, work_on);
    };
    if (options.coherence.kind != Coherence::Kind::sort || rays.size() < kLeastSorted ||
        !scene.tracer().info().is_on_processor)
        return run(nullptr);
    scene.sorter.use([&](RaySorter& sorter) {
        sorter.choose_curve(rays, scene.space().extent());
        run(&sorter);
    });
}

/// Asks a scene's tracer about the triangles that exist. The options must outlive it.
class QueryFilter {
public:
    /// Throws Error for a wrong number of answers, flags or excluded triangles, and for those that
    /// do not exist; `what` names the queries.
    QueryFilter(SceneImpl& scene, std::size_t queries, const char* what, std::size_t answers,
                const QueryOptions& options)
        : scene_(scene), options_(options) {
        require_room(queries, what, answers);
        const std::span<const MeshSlot> slots = scene.meshes().slots();
        if (options.excluded && options.excluded->size() != queries)
            throw_bad_argument("excluded: {} for {} {}", options.excluded->size(), queries, what);
        if (options.excluded) require_there(*options.excluded);
        if (!options.visible) return;
        hides_meshes_ = true;
        // The highest geom_ids may be free since a detach(), and may have flags.
        const std::size_t flags = options.visible->size();
        std::size_t least = slots.size();
        while (least > 0 && !slots[least - 1].used) --least;
        if (flags < least || flags > slots.size())
            throw_bad_argument("visible: {} flags, but {} geom_ids", flags, least);
    }

    const QueryOptions& options() const { return options_; }
    mray::Watch watch() const { return mray::Watch(options_.cancel); }
    bool sees_all() const { return !options_.visible && !options_.excluded; }
    bool sees(std::size_t query, const Hit& hit) const {
        if (options_.visible && (*options_.visible)[hit.geom_id] == 0) return false;
        if (!options_.excluded) return true;
        const Primitive& left_out = (*options_.excluded)[query];
        if (left_out.prim_id == kNoPrim) return hit.geom_id != left_out.geom_id;
        return hit.primitive() != left_out;
    }

    /// Backend::prepare() for queries of this type.
    template <class Query>
    std::size_t prepare() {
        const std::size_t size = scene_.tracer().prepare(mray::is_for_host<Query>(!sees_all()));
        // The device's answers take no subtrees, for which the tree would be read back.
        if (size == 1 && hides_meshes_) meshes_ = scene_.meshes_of_subtrees();
        return size;
    }
    /// Asks a query whose ray or point i is that of this number here, with watch and filter.
    template <class Query, class Number>
    void ask(Query query, Number number) const {
        query.watch = watch();
        if (sees_all()) return scene_.tracer().query(query);
        mray::TriangleFilter filter{[&](std::size_t i, std::uint32_t prim_id) {
            return sees(number(i), scene_.meshes().locate(0, 0, 0, prim_id));
        }};
        if (!meshes_.empty()) {
            filter.hides = [&](std::size_t i, std::size_t subtree) {
                const std::uint32_t geom_id = meshes_[subtree];
                return geom_id != kNoGeometry && !sees(number(i), Hit{0, 0, 0, kNoPrim, geom_id});
            };
        }
        query.filter = &filter;
        scene_.tracer().query(query);
    }

private:
    /// Only a miss may name nothing.
    void require_there(std::span<const Primitive> excluded) {
        for (std::size_t i = 0; i < excluded.size(); ++i) {
            const auto& [prim_id, geom_id] = excluded[i];
            if (excluded[i] == Primitive{}) continue;
            const MeshSlot* const mesh = scene_.meshes().find(geom_id);
            if (mesh == nullptr)
                throw_bad_argument("excluded: number {} has the geom_id {}, which no mesh has", i,
                                   geom_id);
            hides_meshes_ |= prim_id == kNoPrim;
            if (prim_id != kNoPrim && prim_id >= mesh->prim_count)
                throw_bad_argument(
                    "excluded: number {} has the prim_id {} of mesh {}, which has {}", i, prim_id,
                    geom_id, mesh->prim_count);
        }
    }

    SceneImpl& scene_;
    const QueryOptions& options_;
    /// True if a query can leave out several triangles.
    bool hides_meshes_ = false;
    /// SceneImpl::meshes_of_subtrees(), or empty.
    std::span<const std::uint32_t> meshes_;
};

inline mray::vec3 to_vector(const Vec3& p) { return {p.x, p.y, p.z}; }

struct QueryPart {
    SceneImpl& scene;
    const QueryFilter& filter;
    /// The place of each ray or point in the call.
    std::vector<std::size_t> numbers;

    std::size_t size() const { return numbers.size(); }
    mray::Watch watch() const { return filter.watch(); }
    QueryPart chosen(std::span<const std::size_t> places) const {
        QueryPart part{scene, filter, {}};
        for (const std::size_t place : places) part.numbers.push_back(numbers[place]);
        return part;
    }
    template <class Query>
    void ask(const Query& query) const {
        filter.ask(query, [this](std::size_t i) { return numbers[i]; });
    }
};

struct RayPart : QueryPart {
    /// All rays of the call.
    std::span<const Ray> world;
    std::vector<mray::Ray> rays;
    /// What their t are multiplied by.
    std::vector<int> t_exponents;

    RayPart(QueryPart part, std::span<const Ray> all) : QueryPart(std::move(part)), world(all) {
        rays.reserve(size());
        t_exponents.reserve(size());
        for_runs_of(0, size(), {}, [&](std::size_t first, std::size_t count) {
            std::array<Ray, kRun> given;
            for (std::size_t i = 0; i < count; ++i) given[i] = all[numbers[first + i]];
            mray::cpu::SceneRays run;
            scene.space().to_scene(std::span(given).first(count), run);
            rays.insert(rays.end(), run.rays, run.rays + count);
            for (std::size_t i = 0; i < count; ++i)
                t_exponents.push_back(run.t_exponents[2 * i + 1]);
        });
    }
};

struct PointPart : QueryPart {
    /// All points of the call.
    std::span<const Vec3> world;
    /// Points that are not finite have is_finite 0 and some place.
    std::vector<mray::vec3> points;
    /// Before they were rounded, or brought nearer.
    std::vector<mray::dvec3> exact;
    std::vector<std::uint8_t> is_finite;

    PointPart(QueryPart part, std::span<const Vec3> all)
        : QueryPart(std::move(part)),
          world(all),
          points(size(), mray::vec3(0, 0, 0)),
          exact(size(), mray::dvec3(0, 0, 0)),
          is_finite(size()) {
        for (std::size_t i = 0; i < size(); ++i) {
            const Vec3& p = world[numbers[i]];
            is_finite[i] = std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z) ? 1 : 0;
            if (is_finite[i] != 0) scene.space().to_scene(p, exact[i], points[i]);
        }
    }
};

/// Calls work(part), which asks queries of this type about rays or points of a call, for many
/// parts: in many threads, or in this one where calls should be large. The items of all of them
/// have the numbers number(i), i < total. Throws mray::Error(kCancelled).
template <class Part, class Query, class Item, class Number, class Work>
void for_parts(SceneImpl& scene, std::span<const Item> all, std::size_t total, QueryFilter& filter,
               Number number, Work work) {
    // Enough for streams of each octant of directions.
    constexpr std::size_t kBatch = 2048;
    const std::size_t call_size = filter.prepare<Query>();
    const bool is_alone = filter.options().threads == Threads::calling || call_size > kBatch;
    mray::ThreadArena* const arena = is_alone ? nullptr : &scene.arena();
    const auto work_on = [&](std::size_t begin, std::size_t size) {
        QueryPart part{scene, filter, std::vector<std::size_t>(size)};
        for (std::size_t i = 0; i < size; ++i) part.numbers[i] = number(begin + i);
        work(Part(std::move(part), all));
    };
    const auto ask = [&] { for_each_run(arena, total, {}, work_on, std::max(kBatch, call_size)); };
    scene.cost.measure(total, ask);
    filter.watch().throw_if_cancelled();
}

/// As for_parts() for all points of a call, in parts of neighbours; a few stay in their order.
template <class Query, class Work>
void for_point_parts(SceneImpl& scene, std::span<const Vec3> all, QueryFilter& filter,
                     PointOrder by, Work work) {
    constexpr std::size_t kFew = 64;
    // Points that are ordered together, which cannot be cancelled.
    constexpr std::size_t kMost = std::size_t{1} << 20;
    const auto work_on = [&](std::size_t first, std::size_t count) {
        std::vector<std::uint32_t> order;
        if (count > kFew)
            order = order_points(all.subspan(first, count), scene.pose().bounds(), by);
        const auto number = [&](std::size_t i) { return first + (order.empty() ? i : order[i]); };
        for_parts<PointPart, Query>(scene, all, count, filter, number, work);
    };
    mray::for_watched_runs(0, all.size(), filter.watch(), kMost, 0, work_on);
    filter.watch().throw_if_cancelled();
}

}  // namespace morphray::detail
