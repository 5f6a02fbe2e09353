// The members of Scene that ask about all hits of rays.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <mutex>
#include <numeric>
#include <utility>
#include <vector>

#include "common/interop/hit_rule.h"
#include "common/interop/tie_break_rule.h"
#include "common/scene/exact_crossing.h"
#include "library/src/ray_batch.h"
#include "library/src/scene_impl.h"

namespace morphray {
namespace {

using detail::ask_in_parts;
using detail::RayFilter;
using detail::require_room;
using detail::SceneBatch;
using detail::SceneImpl;
using detail::throw_bad_argument;
using detail::with_scene;

mray::Crossing crossing_of(Crossing crossing) {
    return crossing == Crossing::owner ? mray::Crossing::kOwner : mray::Crossing::kEach;
}

/// Makes of all hits of a ray those of Crossing::once.
void keep_crossings(const SceneImpl& scene, const mray::Ray& ray, std::vector<mray::Hit>& hits) {
    mray::keep_one_of_each_crossing(scene.meshes.topology(), scene.pose.positions(),
                                    scene.meshes.first_prims(), ray, hits);
}

/// Takes kTouchesBorder from a number of hits; returns whether Crossing::once may count fewer.
bool take_border_flag(std::uint64_t& count, Crossing crossing) {
    const bool touches = (count & mray::kTouchesBorder) != 0;
    count &= ~mray::kTouchesBorder;
    return touches && count > 1 && crossing == Crossing::once;
}

/// All hits of each ray with triangles that it sees. rays[i] is ray number(i) of the filter.
template <class Number>
std::vector<std::vector<mray::Hit>> list_hits(const SceneImpl& scene,
                                              std::span<const mray::Ray> rays, Crossing crossing,
                                              const RayFilter& filter, Number number) {
    std::vector<std::vector<mray::Hit>> all(rays.size());
    if (rays.empty()) return all;
    mray::HitLists lists;
    constexpr std::uint32_t kAll = std::numeric_limits<std::uint32_t>::max();
    scene.tracer->query(mray::ListQuery{rays, crossing_of(crossing), kAll, lists, filter.watch()});
    auto next = lists.hits.cbegin();
    for (std::size_t i = 0; i < rays.size(); ++i) {
        filter.watch().throw_if_cancelled();
        std::vector<mray::Hit>& hits = all[i];
        hits.assign(next, next + lists.listed[i]);
        next += lists.listed[i];
        if (!filter.sees_all()) {
            std::erase_if(
                hits, [&](const mray::Hit& hit) { return !filter.sees(number(i), hit.prim_id); });
        }
        if (take_border_flag(lists.total[i], crossing)) keep_crossings(scene, rays[i], hits);
    }
    return all;
}

/// Counts hits of rays; rays[i] is ray number(i) of the filter.
template <class Number>
void count_hits(const SceneImpl& scene, std::span<const mray::Ray> rays, Crossing crossing,
                const RayFilter& filter, Number number, std::span<std::uint64_t> counts) {
    std::vector<std::size_t> listed;
    std::vector<mray::Ray> listed_rays;
    if (filter.sees_all())
        scene.tracer->query(mray::CountQuery{rays, crossing_of(crossing), counts, filter.watch()});
    for (std::size_t i = 0; i < rays.size(); ++i) {
        if (filter.sees_all() && !take_border_flag(counts[i], crossing)) continue;
        listed.push_back(i);
        listed_rays.push_back(rays[i]);
    }
    const std::vector<std::vector<mray::Hit>> lists = list_hits(
        scene, listed_rays, crossing, filter, [&](std::size_t k) { return number(listed[k]); });
    for (std::size_t k = 0; k < listed.size(); ++k) counts[listed[k]] = lists[k].size();
}

/// Lists the first hits of rays, which are those of the filter from `first` on. Rays whose hits the
/// filter or Crossing::once may leave out are traced once more, for all hits.
mray::HitLists list_first_hits(const SceneImpl& scene, std::span<const mray::Ray> rays,
                               const AllHitsOptions& options, const RayFilter& filter,
                               std::size_t first) {
    mray::HitLists lists;
    if (filter.sees_all()) {
        scene.tracer->query(mray::ListQuery{rays, crossing_of(options.crossing), options.max_hits,
                                            lists, filter.watch()});
    } else {
        lists.listed.resize(rays.size());
        lists.total.resize(rays.size());
    }
    std::vector<std::size_t> whole;
    std::vector<mray::Ray> whole_rays;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        if (filter.sees_all() && !take_border_flag(lists.total[i], options.crossing)) continue;
        whole.push_back(i);
        whole_rays.push_back(rays[i]);
    }
    if (whole.empty()) return lists;
    const std::vector<std::vector<mray::Hit>> wholes =
        list_hits(scene, whole_rays, options.crossing, filter,
                  [&](std::size_t k) { return first + whole[k]; });
    std::vector<mray::Hit> hits;
    auto next = lists.hits.cbegin();
    for (std::size_t i = 0, k = 0; i < rays.size(); ++i) {
        std::span<const mray::Hit> found(next, next + lists.listed[i]);
        next += lists.listed[i];
        if (k < whole.size() && whole[k] == i) {
            found = wholes[k++];
            lists.total[i] = found.size();
            found = found.first(std::min<std::size_t>(found.size(), options.max_hits));
            lists.listed[i] = static_cast<std::uint32_t>(found.size());
        }
        hits.insert(hits.end(), found.begin(), found.end());
    }
    lists.hits = std::move(hits);
    return lists;
}

mray::Hit find_next(const SceneImpl& scene, const mray::Ray& ray, const mray::HitCursor& after,
                    Crossing crossing, const RayFilter& filter) {
    mray::Hit found;
    for (mray::HitCursor at = after;; at = {found.t, found.prim_id}) {
        scene.tracer->query(
            mray::NextQuery{{&ray, 1}, {&at, 1}, crossing_of(crossing), {&found, 1}});
        if (found.prim_id == mray::kNoPrim) return found;
        if (filter.sees_all() || filter.sees(0, found.prim_id)) break;
    }
    if (crossing != Crossing::once || !mray::may_touch_border({found.t, found.u, found.v}))
        return found;
    const auto lists =
        list_hits(scene, {&ray, 1}, crossing, filter, [](std::size_t) { return std::size_t{0}; });
    for (const mray::Hit& hit : lists[0])
        if (mray::is_closer(after.t, after.prim_id, hit.t, hit.prim_id)) return hit;
    return mray::no_hit();
}

/// The places of an image's rays tile after tile, which are streams.
std::vector<std::uint32_t> tiled_places(std::size_t width, std::size_t total) {
    constexpr std::size_t kSide = 8;
    const std::size_t height = width < kSide ? 0 : total / width / kSide * kSide;
    std::vector<std::uint32_t> places(total);
    auto next = places.begin();
    for (std::size_t tile = 0; tile < height; tile += kSide)
        for (std::size_t left = 0; left < width; left += kSide)
            for (std::size_t y = tile; y < tile + kSide; ++y)
                for (std::size_t x = left; x < std::min(left + kSide, width); ++x)
                    *next++ = static_cast<std::uint32_t>(y * width + x);
    std::iota(next, places.end(), static_cast<std::uint32_t>(next - places.begin()));
    return places;
}

/// t in scene space of a hit of the last one of `passed` triangles by `world`, which is `ray`
/// there. A power of two gives it exactly, unless t is rounded in world space: where it is a
/// denormal, or too large for a float, or the ray is far. Then the triangle is asked again.
float scene_t(const SceneImpl& scene, const Ray& world, const mray::Ray& ray, int t_exponent,
              float world_t, std::uint32_t passed) {
    using Limits = std::numeric_limits<float>;
    const float t = scene.space->to_scene_t(world, world_t, t_exponent);
    const bool is_exact =
        world_t >= Limits::min() && world_t < Limits::max() && !detail::is_far(t_exponent);
    if (is_exact || passed == 0) return t;
    const mray::uvec3 corners = scene.meshes.topology().triangles[passed - 1];
    const std::span<const mray::vec3> positions = scene.pose.positions();
    mray::TriangleHit hit;
    const bool is_hit = mray::intersect_triangle(mray::shear_ray(ray.org, ray.dir), ray.tnear,
                                                 ray.tfar, positions[corners.x],
                                                 positions[corners.y], positions[corners.z], hit);
    return is_hit && scene.space->to_world_t(world, hit.t, t_exponent) == world_t ? hit.t : t;
}

}  // namespace

void Scene::count(std::span<const Ray> rays, std::span<std::uint64_t> counts, Crossing crossing,
                  const QueryOptions& options) const {
    with_scene(impl_, [&](SceneImpl& scene) {
        require_room(rays.size(), "rays", counts.size());
        const RayFilter filter(scene.meshes, rays.size(), options);
        const auto count_part = [&](std::size_t first, std::span<const Ray> part,
                                    std::span<const std::uint32_t> order) {
            ask_in_parts(scene, part.size(), options, [&](std::size_t begin, std::size_t size) {
                const auto place = [&](std::size_t i) {
                    return order.empty() ? begin + i : order[begin + i];
                };
                std::vector<Ray> gathered(order.empty() ? 0 : size);
                for (std::size_t i = 0; i < gathered.size(); ++i) gathered[i] = part[place(i)];
                const SceneBatch batch(
                    *scene.space, order.empty() ? part.subspan(begin, size) : std::span(gathered));
                std::vector<std::uint64_t> found(size);
                count_hits(
                    scene, batch.rays, crossing, filter,
                    [&](std::size_t i) { return first + place(i); }, found);
                for (std::size_t i = 0; i < size; ++i) counts[first + place(i)] = found[i];
            });
        };
        const mray::Watch watch(options.cancel);
        const bool sorts = options.coherence.kind == Coherence::Kind::sort;
        constexpr std::uint32_t kMostTiled = std::numeric_limits<std::uint32_t>::max();
        if (options.coherence.kind == Coherence::Kind::image && rays.size() <= kMostTiled) {
            count_part(0, rays, tiled_places(options.coherence.width, rays.size()));
        } else {
            detail::for_ordered_parts(scene, rays, sorts, detail::RaySorter::kMost, &scene.arena(),
                                      watch, count_part);
        }
        watch.throw_if_cancelled();
    });
}

AllHits Scene::intersect_all(std::span<const Ray> rays, const AllHitsOptions& all_options,
                             const QueryOptions& options) const {
    struct Part {
        std::size_t first;
        std::vector<std::uint32_t> listed;
        std::vector<std::uint64_t> total;
        std::vector<Hit> hits;
    };
    return with_scene(impl_, [&](SceneImpl& scene) {
        const RayFilter filter(scene.meshes, rays.size(), options);
        std::mutex mutex;
        std::vector<Part> parts;
        ask_in_parts(scene, rays.size(), options, [&](std::size_t begin, std::size_t size) {
            const SceneBatch batch(*scene.space, rays.subspan(begin, size));
            mray::HitLists lists = list_first_hits(scene, batch.rays, all_options, filter, begin);
            Part part{begin, std::move(lists.listed), std::move(lists.total), {}};
            part.hits.reserve(lists.hits.size());
            auto hit = lists.hits.begin();
            for (std::size_t i = 0; i < size; ++i) {
                for (std::uint32_t k = 0; k < part.listed[i]; ++k)
                    part.hits.push_back(to_world(scene.meshes, *scene.space, rays[begin + i],
                                                 *hit++, batch.t_exponents[i]));
            }
            const std::scoped_lock lock(mutex);
            parts.push_back(std::move(part));
        });
        std::ranges::sort(parts, {}, &Part::first);
        AllHits all;
        all.offsets.reserve(rays.size() + 1);
        all.left_out.reserve(rays.size());
        std::size_t hit_count = 0;
        for (const Part& part : parts) hit_count += part.hits.size();
        all.hits.reserve(hit_count);
        for (Part& part : parts) {
            for (std::size_t i = 0; i < part.listed.size(); ++i) {
                all.offsets.push_back(all.offsets.back() + part.listed[i]);
                all.left_out.push_back(part.total[i] - part.listed[i]);
            }
            all.hits.insert(all.hits.end(), part.hits.begin(), part.hits.end());
            part = {};
        }
        return all;
    });
}

Hit Scene::intersect(const Ray& ray, const Hit& after, Crossing crossing,
                     const QueryOptions& options) const {
    return with_scene(impl_, [&](SceneImpl& scene) -> Hit {
        if (std::isnan(after.t)) throw_bad_argument("after: its t is NaN");
        const RayFilter filter(scene.meshes, 1, options);
        Hit hit;
        if (!after) return hit;
        ask_in_parts(scene, 1, options, [&](std::size_t, std::size_t) {
            mray::Ray asked;
            const std::optional<int> t_exponent = scene.space->to_scene(ray, asked);
            if (!t_exponent) return;
            mray::HitCursor cursor;
            const std::uint32_t passed = scene.meshes.count_up_to(after.geom_id, after.prim_id);
            cursor.t = scene_t(scene, ray, asked, *t_exponent, after.t, passed);
            if (passed != 0) {
                cursor.prim_id = passed - 1;
            } else {  // All hits at this t come after it.
                cursor.t = std::nextafter(cursor.t, -std::numeric_limits<float>::infinity());
                cursor.prim_id = mray::kNoPrim;
            }
            hit = to_world(scene.meshes, *scene.space, ray,
                           find_next(scene, asked, cursor, crossing, filter), *t_exponent);
        });
        return hit;
    });
}

}  // namespace morphray
