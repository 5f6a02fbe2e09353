#include "cpu/reference/scalar_tracer.h"

#include <glm/geometric.hpp>

#include "common/interop/closest_rule.h"
#include "common/interop/tie_break_rule.h"
#include "common/interop/winding_rule.h"

namespace mray::cpu {
namespace {

using glm::dvec3;

template <class Visit>
void for_each_mesh_triangle(const Topology& topology, std::span<const vec3> positions,
                            Visit visit) {
    std::uint32_t prim_id = 0;
    for (const uvec3& t : topology.triangles)
        visit(positions[t.x], positions[t.y], positions[t.z], prim_id++);
}

std::uint64_t border_flag(const Hit& hit) {
    return may_touch_border(hit.u, hit.v) ? kTouchesBorder : 0;
}

bool is_before(const Hit& a, const Hit& b) { return is_closer(a.t, a.prim_id, b.t, b.prim_id); }

/// Answers queries about a mesh, one ray or point after the other.
struct BruteAnswers {
    const Topology& topology;
    std::span<const vec3> positions;

    void answer(const CountQuery& query) const {
        for (std::size_t i = 0; i < query.rays.size(); ++i) {
            std::uint64_t& count = query.counts[i];
            count = 0;
            for_each_hit(query, i, [&](const Hit& hit) { count = (count + 1) | border_flag(hit); });
        }
    }

    void answer(const ListQuery& query) const {
        HitLists& lists = query.lists;
        for (std::size_t i = 0; i < query.rays.size(); ++i) {
            const std::size_t first = lists.hits.size();
            std::uint64_t flag = 0;
            for_each_hit(query, i, [&](const Hit& hit) {
                lists.hits.push_back(hit);
                flag |= border_flag(hit);
            });
            const std::size_t total = lists.hits.size() - first;
            std::ranges::sort(std::span(lists.hits).subspan(first), is_before);
            const std::size_t listed = std::min<std::size_t>(total, query.most);
            lists.hits.resize(first + listed);
            lists.listed.push_back(static_cast<std::uint32_t>(listed));
            lists.total.push_back(total | flag);
        }
    }

    void answer(const NextQuery& query) const {
        for (std::size_t i = 0; i < query.rays.size(); ++i) {
            const HitCursor& after = query.after[i];
            Hit& next = query.hits[i];
            next = no_hit();
            for_each_hit(query, i, [&](const Hit& hit) {
                const bool is_after = is_closer(after.t, after.prim_id, hit.t, hit.prim_id);
                if (is_after && (next.prim_id == kNoPrim || is_before(hit, next))) next = hit;
            });
        }
    }

    void answer(const WindingQuery& query) const {
        for (std::size_t i = 0; i < query.points.size(); ++i) {
            query.windings[i] = {};
            const vec3 p = clipped_point(query.points[i]);
            for_each_seen(query, i, [&](vec3 a, vec3 b, vec3 c, std::uint32_t prim_id) {
                const FloatCrossing crossing = float_crossing(p, a, b, c);
                query.windings[i].winding += crossing.is_up - crossing.is_down;
                query.windings[i].crossings += crossing.is_up || crossing.is_down;
                if (crossing.is_uncertain)
                    query.uncertain.push_back({static_cast<std::uint32_t>(i), prim_id});
            });
        }
    }

    void answer(const ClosestQuery& query) const {
        for (std::size_t i = 0; i < query.points.size(); ++i) {
            ClosestTriangle& closest = query.closest[i];
            closest = {query.most_d2, kNoPrim};
            for_each_seen(query, i, [&](vec3 a, vec3 b, vec3 c, std::uint32_t prim_id) {
                const float d2 = triangle_distance2(query.points[i], a, b, c);
                if (is_closer(d2, prim_id, closest.d2, closest.prim_id)) closest = {d2, prim_id};
            });
        }
    }

    void answer(const ExactClosestQuery& query) const {
        for (std::size_t i = 0; i < query.points.size(); ++i) {
            std::vector<NumberedTriangle> all;
            for_each_seen(query, i, [&](vec3 a, vec3 b, vec3 c, std::uint32_t prim_id) {
                all.push_back({prim_id, {a, b, c}});
            });
            query.closest[i] =
                all.empty() ? NumberedTriangle{kNoPrim, {}} : exact_closest(query.exact[i], all);
        }
    }

    template <class Query>
    static bool sees(const Query& query, std::size_t i, std::uint32_t prim_id) {
        return query.filter == nullptr || query.filter->sees(i, prim_id);
    }

    /// Calls visit(hit) for the hits of ray i of a query.
    template <class Query, class Visit>
    void for_each_hit(const Query& query, std::size_t i, Visit visit) const {
        query.watch.throw_if_cancelled();
        const Ray& ray = query.rays[i];
        const ShearedRay sheared = shear_ray(ray.org, ray.dir);
        const auto test = [&](vec3 a, vec3 b, vec3 c, std::uint32_t prim_id) {
            TriangleHit hit;
            if (!intersect_triangle(sheared, ray.tnear, ray.tfar, a, b, c, hit)) return;
            if (query.crossing == Crossing::kOwner && !owns_hit(sheared, a, b, c, hit)) return;
            if (sees(query, i, prim_id)) visit(make_hit(hit, prim_id));
        };
        for_each_mesh_triangle(topology, positions, test);
    }

    /// Calls visit(a, b, c, prim_id) for the triangles that point i of a query sees.
    template <class Query, class Visit>
    void for_each_seen(const Query& query, std::size_t i, Visit visit) const {
        query.watch.throw_if_cancelled();
        const auto test = [&](vec3 a, vec3 b, vec3 c, std::uint32_t prim_id) {
            if (finite_vertices(a, b, c) && sees(query, i, prim_id)) visit(a, b, c, prim_id);
        };
        for_each_mesh_triangle(topology, positions, test);
    }
};

}  // namespace

Hit BruteTracer::intersect(const Ray& ray) const {
    ClosestHit closest(ray);
    for_each_mesh_triangle(*topology_, positions_,
                           [&](auto... triangle) { closest.test(triangle...); });
    return closest.hit();
}

bool BruteTracer::occluded(const Ray& ray) const {
    const ShearedRay sheared = shear_ray(ray.org, ray.dir);
    for (const uvec3& t : topology_->triangles) {
        if (hits_triangle(sheared, ray, positions_[t.x], positions_[t.y], positions_[t.z]))
            return true;
    }
    return false;
}

void BruteTracer::operator()(const QueryBatch& batch) const {
    const BruteAnswers answers{*topology_, positions_};
    std::visit([&](const auto& query) { answers.answer(query); }, batch);
}

}  // namespace mray::cpu
