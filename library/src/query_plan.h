// How the rays and points of a call are divided: among threads, into calls of the tracer, and in
// which order; what that costs, and the parts in scene space that are asked about together.
#pragma once

#include <tbb/blocked_range.h>

#include "common/watched_runs.h"
#include "library/src/query_filter.h"

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

    RayPart(QueryPart part, std::span<const Ray> all);
};

struct PointPart : QueryPart {
    /// All points of the call.
    std::span<const Vec3> world;
    /// Points that are not finite have is_finite 0 and some place.
    std::vector<mray::vec3> points;
    /// Before they were rounded, or brought nearer.
    std::vector<mray::dvec3> exact;
    std::vector<std::uint8_t> is_finite;

    PointPart(QueryPart part, std::span<const Vec3> all);
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
