// Rays and points of a call in scene space, as many as are asked about together.
#pragma once

#include "library/src/query_plan.h"

namespace morphray::detail {

inline mray::vec3 to_vector(const Vec3& p) { return {p.x, p.y, p.z}; }

struct QueryPart {
    SceneImpl& scene;
    const QueryFilter& filter;
    /// The place of each ray or point in the call.
    std::vector<std::size_t> numbers;

    std::size_t size() const { return numbers.size(); }
    mray::Watch watch() const { return filter.watch(); }
    /// Asks a query about them.
    template <class Query>
    void ask(const Query& query) const {
        filter.ask(query, [this](std::size_t i) { return numbers[i]; });
    }
};

struct RayPart : QueryPart {
    std::vector<mray::Ray> rays;
    /// What their t are multiplied by.
    std::vector<int> t_exponents;

    RayPart(QueryPart part, std::span<const Ray> all);
    RayPart(const RayPart& other, std::span<const std::size_t> chosen);
};

/// Calls work(part), which asks queries of this type about rays of a call, for many parts; ray i of
/// all of them has number(i) in the call. As for_query_parts().
template <class Query, class Number, class Work>
void for_ray_parts(SceneImpl& scene, std::span<const Ray> all, std::size_t total,
                   QueryFilter& filter, Number number, Work work) {
    for_query_parts<Query>(scene, total, filter, [&](std::size_t begin, std::size_t size) {
        QueryPart part{scene, filter, std::vector<std::size_t>(size)};
        for (std::size_t i = 0; i < size; ++i) part.numbers[i] = number(begin + i);
        work(RayPart(std::move(part), all));
    });
}

/// Points that are converted and ordered together, which cannot be cancelled.
struct PointBlock {
    SceneImpl& scene;
    QueryFilter& filter;
    /// All points of the call.
    std::span<const Vec3> world;
    std::size_t first;
    /// From number `first` on. Those that are not finite have is_finite 0 and some place.
    std::vector<mray::vec3> points = {};
    /// Before they were rounded, or brought nearer.
    std::vector<mray::dvec3> exact = {};
    std::vector<std::uint8_t> is_finite = {};

    void convert(std::size_t count);
    /// Calls work(part), which asks queries of this type, for parts of neighbours; a few points
    /// stay in the order given. As for_query_parts().
    template <class Query, class Work>
    void for_parts(PointOrder by, Work work) const;
};

struct PointPart : QueryPart {
    const PointBlock& block;
    std::vector<mray::vec3> points;

    PointPart(const PointBlock& all, std::vector<std::size_t> own);

    const Vec3& world(std::size_t i) const { return block.world[numbers[i]]; }
    const mray::dvec3& exact(std::size_t i) const { return block.exact[numbers[i] - block.first]; }
    bool is_finite(std::size_t i) const { return block.is_finite[numbers[i] - block.first] != 0; }
};

template <class Query, class Work>
void PointBlock::for_parts(PointOrder by, Work work) const {
    constexpr std::size_t kFew = 64;
    std::vector<std::uint32_t> order;
    if (points.size() > kFew) order = order_points(points, by);
    const auto work_on = [&](std::size_t begin, std::size_t size) {
        std::vector<std::size_t> numbers(size);
        for (std::size_t i = 0; i < size; ++i)
            numbers[i] = first + (order.empty() ? begin + i : order[begin + i]);
        work(PointPart(*this, std::move(numbers)));
    };
    for_query_parts<Query>(scene, points.size(), filter, work_on);
}

/// Calls work(block) for blocks of points. Throws Error for wrong options, and
/// mray::Error(kCancelled).
template <class Work>
void for_point_blocks(SceneImpl& scene, std::span<const Vec3> points, std::size_t answer_count,
                      const QueryOptions& options, Work work) {
    constexpr std::size_t kMost = std::size_t{1} << 20;
    require_room(points.size(), "points", answer_count);
    QueryFilter filter(scene, points.size(), "points", options);
    const auto work_on = [&](std::size_t first, std::size_t count) {
        PointBlock block{scene, filter, points, first};
        block.convert(count);
        work(std::as_const(block));
    };
    mray::for_watched_runs(0, points.size(), filter.watch(), kMost, 0, work_on);
    filter.watch().throw_if_cancelled();
}

}  // namespace morphray::detail
