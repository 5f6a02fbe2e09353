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

struct PointPart : QueryPart {
    /// All points of the call.
    std::span<const Vec3> world;
    /// Those that are not finite have is_finite 0 and some place.
    std::vector<mray::vec3> points;
    /// Before they were rounded, or brought nearer.
    std::vector<mray::dvec3> exact;
    std::vector<std::uint8_t> is_finite;

    PointPart(QueryPart part, std::span<const Vec3> all);
};

/// Calls work(part), which asks queries of this type about rays or points of a call, for many
/// parts; the items of all of them have the numbers number(i), i < total. As for_query_parts().
template <class Part, class Query, class Item, class Number, class Work>
void for_parts(SceneImpl& scene, std::span<const Item> all, std::size_t total, QueryFilter& filter,
               Number number, Work work) {
    for_query_parts<Query>(scene, total, filter, [&](std::size_t begin, std::size_t size) {
        QueryPart part{scene, filter, std::vector<std::size_t>(size)};
        for (std::size_t i = 0; i < size; ++i) part.numbers[i] = number(begin + i);
        work(Part(std::move(part), all));
    });
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
