#include "cpu/queries/tree_queries.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "cpu/queries/tree_queries.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "cpu/queries/tree_queries-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu::HWY_NAMESPACE {

void answer(const Bvh& bvh, const CountQuery& query) {
    const std::span<const Ray> rays = query.rays;
    if (rays.size() <= kCountedTogether || query.filter != nullptr) {
        for_each_asked(query, rays.size(), [&](std::size_t i, auto sees) HWY_ATTR {
            query.counts[i] = count_hits_of(bvh, rays[i], query.crossing, sees);
        });
        return;
    }
    for_each_stream(rays, [&](const Ray* batch, std::span<const std::uint16_t> order,
                              std::size_t first) HWY_ATTR {
        query.watch.throw_if_cancelled();
        CountStream(bvh, batch, order, query.crossing).count(&query.counts[first]);
    });
}

void answer(const Bvh& bvh, const ListQuery& query) {
    for_each_asked(query, query.rays.size(), [&](std::size_t i, auto sees) HWY_ATTR {
        list_hits_of(bvh, query.rays[i], query.crossing, query.most, query.lists, sees);
    });
}

void answer(const Bvh& bvh, const NextQuery& query) {
    for_each_asked(query, query.rays.size(), [&](std::size_t i, auto sees) HWY_ATTR {
        query.hits[i] = next_hit_of(bvh, query.rays[i], query.crossing, query.after[i], sees);
    });
}

/// Whether bundles pay, by the leaves that they and single points have visited so far.
class BundleChoice {
public:
    /// Whether the next points are to be tried as a bundle.
    bool tries() {
        if (wait_ == 0) return true;
        --wait_;
        return false;
    }
    /// The leaves that a bundle may visit before it is given up: about as many as 7 points do,
    /// which take as long one after the other.
    std::size_t most_leaves() const { return static_cast<std::size_t>(7 * leaves_of_point_); }
    void succeeded() { next_wait_ = kFirstWait; }
    void gave_up() {
        wait_ = next_wait_;
        next_wait_ = std::min<std::size_t>(2 * next_wait_, 48);
    }
    /// After `points` without a bundle that visited so many leaves.
    void add(std::size_t points, std::size_t leaves) {
        const float now = static_cast<float>(leaves) / static_cast<float>(points);
        leaves_of_point_ += 0.5f * (now - leaves_of_point_);
    }

private:
    static constexpr std::size_t kFirstWait = 3;

    float leaves_of_point_ = 4;
    std::size_t wait_ = 0, next_wait_ = kFirstWait;
};

void answer(const Bvh& bvh, const WindingQuery& query) {
    const std::span<const vec3> points = query.points;
    std::vector<UncertainCrossing>& uncertain = query.uncertain;
    const auto add_uncertain = [&](std::size_t point, std::uint32_t prim_id) {
        uncertain.push_back({static_cast<std::uint32_t>(point), prim_id});
    };
    std::size_t leaves = 0;
    const auto wind = [&](std::size_t i, auto sees) {
        query.windings[i] = wind_around(bvh, points[i], leaves, sees,
                                        [&](std::uint32_t prim_id) { add_uncertain(i, prim_id); });
    };
    // Returns false for a bundle that was given up.
    const auto wind_together = [&](std::size_t first, std::size_t count, std::size_t most_leaves) {
        vec3 clipped[kLanes];
        for (std::size_t i = 0; i < count; ++i) clipped[i] = clipped_point(points[first + i]);
        const std::size_t before = uncertain.size();
        WindingBundle search(std::span<const vec3>(clipped, count));
        const bool found = search.search(
            bvh, most_leaves,
            [&](std::size_t i, std::uint32_t prim_id) { add_uncertain(first + i, prim_id); });
        if (found) {
            search.store_windings(query.windings.subspan(first, count));
        } else {
            uncertain.resize(before);
        }
        return found;
    };
    // Calls about fewer points come in any order, and their bundles would be wide.
    constexpr std::size_t kManyPoints = 256;
    if (kLanes > 1 && points.size() >= kManyPoints && query.filter == nullptr) {
        BundleChoice choice;
        for (std::size_t first = 0; first < points.size(); first += kLanes) {
            query.watch.throw_if_cancelled();
            const std::size_t count = std::min<std::size_t>(kLanes, points.size() - first);
            if (choice.tries()) {
                if (wind_together(first, count, choice.most_leaves())) {
                    choice.succeeded();
                    continue;
                }
                choice.gave_up();
            }
            leaves = 0;
            for (std::size_t i = first; i < first + count; ++i) wind(i, SeesAll{});
            choice.add(count, leaves);
        }
        return;
    }
    for_each_asked(query, points.size(), wind);
}

void answer(const Bvh& bvh, const ClosestQuery& query) {
    std::uint32_t near_leaf = kNoPrim;
    NearTriangles near;
    for_each_asked(query, query.points.size(), [&](std::size_t i, auto sees) HWY_ATTR {
        ClosestSearch<false, decltype(sees)> search(query.points[i], query.most_d2, sees, near);
        search.search(bvh, near_leaf);
        query.closest[i] = search.closest();
    });
}

/// The rivals of all points are found before one of each is chosen, which takes other memory.
void answer(const Bvh& bvh, const ExactClosestQuery& query) {
    Rivals rivals;
    rivals.triangles.reserve(query.points.size());
    std::uint32_t near_leaf = kNoPrim;
    NearTriangles near;
    for_each_asked(query, query.points.size(), [&](std::size_t i, auto sees) HWY_ATTR {
        near.clear();
        ClosestSearch<true, decltype(sees)> search(query.points[i], query.most_d2, sees, near);
        search.search(bvh, near_leaf);
        search.append_to(rivals, bvh, query.exact[i]);
    });
    std::size_t first = 0;
    for_each_asked(query, query.points.size(), [&](std::size_t i, auto sees) HWY_ATTR {
        const auto own = std::span(rivals.triangles).subspan(first, rivals.ends[i] - first);
        first = rivals.ends[i];
        query.closest[i] = closest_of(bvh, query.exact[i], own, sees);
    });
}

void answer_batch(const Bvh& bvh, const QueryBatch& batch) {
    std::visit([&](const auto& query) HWY_ATTR { answer(bvh, query); }, batch);
}

}  // namespace mray::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

#include "common/simd/simd_dispatch-inl.h"

namespace mray::cpu {

HWY_EXPORT(answer_batch);

TreeQueries::TreeQueries(const Bvh& bvh, SimdTarget target)
    : bvh_(&bvh), answer_(SIMD_FUNCTION(answer_batch, target)) {}

}  // namespace mray::cpu

#endif  // HWY_ONCE
