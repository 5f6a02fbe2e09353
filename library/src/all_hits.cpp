// All hits of rays: lists, numbers, and the next one after a hit. Rays become queries in scene
// space; Crossing::once is decided here, by whole lists of the rays that may touch borders.
#include <cmath>
#include <numeric>

#include "common/interop/hit_rule.h"
#include "common/interop/tie_break_rule.h"
#include "common/scene/exact_crossing.h"
#include "library/src/query_plan.h"

namespace morphray {
namespace {

using namespace detail;

mray::Crossing crossing_of(Crossing crossing) {
    return crossing == Crossing::owner ? mray::Crossing::kOwner : mray::Crossing::kEach;
}

/// Takes kTouchesBorder from a number of hits; returns whether Crossing::once may count fewer.
bool take_border_flag(std::uint64_t& count, Crossing crossing) {
    const bool touches = (count & mray::kTouchesBorder) != 0;
    count &= ~mray::kTouchesBorder;
    return touches && count > 1 && crossing == Crossing::once;
}

/// All hits of each ray with triangles that it sees.
std::vector<std::vector<mray::Hit>> list_hits(const RayPart& part, Crossing crossing) {
    constexpr std::uint32_t kAllHits = std::numeric_limits<std::uint32_t>::max();
    std::vector<std::vector<mray::Hit>> all(part.size());
    mray::HitLists lists;
    part.ask(mray::ListQuery{part.rays, crossing_of(crossing), kAllHits, lists});
    const MeshList& meshes = part.scene.meshes();
    auto next = lists.hits.cbegin();
    for (std::size_t i = 0; i < part.size(); ++i) {
        part.watch().throw_if_cancelled();
        all[i].assign(next, next + lists.listed[i]);
        next += lists.listed[i];
        if (take_border_flag(lists.total[i], crossing)) {
            mray::keep_one_of_each_crossing(meshes.topology(), part.scene.pose().positions(),
                                            meshes.first_prims(), part.rays[i], all[i]);
        }
    }
    return all;
}

/// Lists all hits of rays for which the tracer's numbers of hits may be too large: by
/// Crossing::once those that touch borders. Corrects the numbers. Returns the lists of all rays,
/// which are empty for others.
std::vector<std::vector<mray::Hit>> list_uncertain(const RayPart& part, Crossing crossing,
                                                   std::span<std::uint64_t> totals) {
    std::vector<std::size_t> places;
    for (std::size_t i = 0; i < totals.size(); ++i)
        if (take_border_flag(totals[i], crossing)) places.push_back(i);
    if (places.empty()) return {};
    std::vector<std::vector<mray::Hit>> whole(totals.size());
    auto lists = list_hits(RayPart(part.chosen(places), part.world), crossing);
    for (std::size_t k = 0; k < places.size(); ++k) {
        totals[places[k]] = lists[k].size();
        whole[places[k]] = std::move(lists[k]);
    }
    return whole;
}

mray::HitLists list_first_hits(const RayPart& part, const AllHitsOptions& options) {
    mray::HitLists lists;
    part.ask(mray::ListQuery{part.rays, crossing_of(options.crossing), options.max_hits, lists});
    const auto whole = list_uncertain(part, options.crossing, lists.total);
    if (whole.empty()) return lists;
    std::vector<mray::Hit> hits;
    auto next = lists.hits.cbegin();
    for (std::size_t i = 0; i < part.size(); ++i) {
        std::span<const mray::Hit> found(next, next + lists.listed[i]);
        next += lists.listed[i];
        if (!whole[i].empty()) {
            found = whole[i];
            found = found.first(std::min<std::size_t>(found.size(), options.max_hits));
            lists.listed[i] = static_cast<std::uint32_t>(found.size());
        }
        hits.insert(hits.end(), found.begin(), found.end());
    }
    lists.hits = std::move(hits);
    return lists;
}

/// t in scene space of a hit of the last one of `passed` triangles by `world`, which is `ray`
/// there. A power of two gives it exactly, unless t is rounded in world space: a denormal, too
/// large for a float, or of a far ray. Then the triangle is intersected again.
float scene_t(const SceneImpl& scene, const Ray& world, const mray::Ray& ray, int t_exponent,
              float world_t, std::uint32_t passed) {
    using Limits = std::numeric_limits<float>;
    const float t = scene.space().to_scene_t(world, world_t, t_exponent);
    const bool is_exact =
        world_t >= Limits::min() && world_t < Limits::max() && !is_far(t_exponent);
    if (is_exact || passed == 0) return t;
    const mray::uvec3 corners = scene.meshes().topology().triangles[passed - 1];
    const std::span<const mray::vec3> positions = scene.pose().positions();
    mray::TriangleHit hit;
    const bool is_hit = mray::intersect_triangle(mray::shear_ray(ray.org, ray.dir), ray.tnear,
                                                 ray.tfar, positions[corners.x],
                                                 positions[corners.y], positions[corners.z], hit);
    return is_hit && scene.space().to_world_t(world, hit.t, t_exponent) == world_t ? hit.t : t;
}

/// The next hit of a ray, the only one of its call: `world`, which is `ray` in scene space.
mray::Hit find_next(SceneImpl& scene, const QueryFilter& filter, const Ray& world,
                    const mray::Ray& ray, const mray::HitCursor& after, Crossing crossing) {
    mray::Hit found;
    filter.ask(mray::NextQuery{{&ray, 1}, {&after, 1}, crossing_of(crossing), {&found, 1}},
               std::identity());
    if (found.prim_id == mray::kNoPrim) return found;
    if (crossing != Crossing::once || !mray::may_touch_border(found.u, found.v)) return found;
    const RayPart part({scene, filter, {0}}, {&world, 1});
    const auto lists = list_hits(part, crossing);
    for (const mray::Hit& hit : lists.front())
        if (mray::is_closer(after.t, after.prim_id, hit.t, hit.prim_id)) return hit;
    return mray::no_hit();
}

}  // namespace

void Scene::count(std::span<const Ray> rays, std::span<std::uint64_t> counts, Crossing crossing,
                  const QueryOptions& options) const {
    with_scene(impl_, [&](SceneImpl& scene) {
        QueryFilter filter(scene, rays.size(), "rays", counts.size(), options);
        const auto count_part = [&](const RayPart& part) {
            std::vector<std::uint64_t> found(part.size());
            part.ask(mray::CountQuery{part.rays, crossing_of(crossing), found});
            list_uncertain(part, crossing, found);
            for (std::size_t i = 0; i < part.size(); ++i) counts[part.numbers[i]] = found[i];
        };
        const auto count_batch = [&](std::size_t first, auto batch, auto order) {
            const auto number = [&](std::size_t i) {
                return first + (order.empty() ? i : order[i]);
            };
            for_parts<RayPart, mray::CountQuery>(scene, rays, batch.size(), filter, number,
                                                 count_part);
        };
        constexpr std::uint32_t kMostTiled = std::numeric_limits<std::uint32_t>::max();
        if (options.coherence.kind == Coherence::Kind::image && rays.size() <= kMostTiled) {
            count_batch(0, rays, tiled_places(options.coherence.width, rays.size()));
        } else {
            for_ordered_batches(scene, rays, options, RaySorter::kMost, &scene.arena(),
                                count_batch);
        }
        filter.watch().throw_if_cancelled();
    });
}

AllHits Scene::intersect_all(std::span<const Ray> rays, const AllHitsOptions& all_options,
                             const QueryOptions& options) const {
    return with_scene(impl_, [&](SceneImpl& scene) {
        QueryFilter filter(scene, rays.size(), "rays", rays.size(), options);
        AllHits all;
        all.offsets.resize(rays.size() + 1);
        all.left_out.resize(rays.size());
        std::mutex mutex;
        std::map<std::size_t, std::vector<Hit>> found;
        const auto list = [&](const RayPart& part) {
            const mray::HitLists lists = list_first_hits(part, all_options);
            std::vector<Hit> hits;
            hits.reserve(lists.hits.size());
            auto hit = lists.hits.begin();
            for (std::size_t i = 0; i < part.size(); ++i) {
                const std::size_t number = part.numbers[i];
                all.offsets[number + 1] = lists.listed[i];
                all.left_out[number] = lists.total[i] - lists.listed[i];
                for (std::uint32_t k = 0; k < lists.listed[i]; ++k)
                    hits.push_back(to_world(scene.meshes(), scene.space(), rays[number], *hit++,
                                            part.t_exponents[i]));
            }
            const std::scoped_lock lock(mutex);
            found.emplace(part.numbers.front(), std::move(hits));
        };
        for_parts<RayPart, mray::ListQuery>(scene, rays, rays.size(), filter, std::identity(),
                                            list);
        std::partial_sum(all.offsets.begin(), all.offsets.end(), all.offsets.begin());
        all.hits.reserve(all.offsets.back());
        for (auto& [first, hits] : found) {
            all.hits.insert(all.hits.end(), hits.begin(), hits.end());
            hits = {};
        }
        return all;
    });
}

Hit Scene::intersect(const Ray& ray, const Hit& after, Crossing crossing,
                     const QueryOptions& options) const {
    return with_scene(impl_, [&](SceneImpl& scene) -> Hit {
        if (std::isnan(after.t)) throw_bad_argument("after: its t is NaN");
        QueryFilter filter(scene, 1, "rays", 1, options);
        Hit hit;
        if (!after) return hit;
        if (!filter.sees_all()) filter.prepare<mray::NextQuery>();
        scene.cost.measure(1, [&] {
            mray::Ray asked;
            const std::optional<int> t_exponent = scene.space().to_scene(ray, asked);
            if (!t_exponent) return;
            mray::HitCursor cursor;
            const std::uint32_t passed = scene.meshes().count_up_to(after.geom_id, after.prim_id);
            cursor.t = scene_t(scene, ray, asked, *t_exponent, after.t, passed);
            if (passed != 0) {
                cursor.prim_id = passed - 1;
            } else {  // All hits at this t come after it.
                cursor.t = std::nextafter(cursor.t, -std::numeric_limits<float>::infinity());
                cursor.prim_id = mray::kNoPrim;
            }
            hit = to_world(scene.meshes(), scene.space(), ray,
                           find_next(scene, filter, ray, asked, cursor, crossing), *t_exponent);
        });
        filter.watch().throw_if_cancelled();
        return hit;
    });
}

}  // namespace morphray
