// The members of Scene that ask about all hits of rays.
#include <fmt/format.h>

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
#include "common/scene/border_crossings.h"
#include "library/src/scene_impl.h"

namespace morphray {
namespace {

using detail::ask_in_parts;
using detail::require_room;
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

/// All hits of each ray, by Crossing::once.
std::vector<std::vector<mray::Hit>> list_crossings(const SceneImpl& scene,
                                                   std::span<const mray::Ray> rays) {
    std::vector<std::vector<mray::Hit>> crossings(rays.size());
    if (rays.empty()) return crossings;
    mray::HitLists lists;
    constexpr std::uint32_t kAll = std::numeric_limits<std::uint32_t>::max();
    scene.tracer->query(mray::ListQuery{rays, mray::Crossing::kEach, kAll, lists});
    auto first = lists.hits.cbegin();
    for (std::size_t i = 0; i < rays.size(); ++i) {
        crossings[i].assign(first, first + lists.listed[i]);
        keep_crossings(scene, rays[i], crossings[i]);
        first += lists.listed[i];
    }
    return crossings;
}

/// Takes kTouchesBorder from a number of hits; returns whether Crossing::once may count fewer.
bool take_border_flag(std::uint64_t& count, Crossing crossing) {
    const bool touches = (count & mray::kTouchesBorder) != 0;
    count &= ~mray::kTouchesBorder;
    return touches && count > 1 && crossing == Crossing::once;
}

/// Makes numbers of each hit, with kTouchesBorder, those of `crossing`.
void finish_counts(const SceneImpl& scene, std::span<const mray::Ray> rays, Crossing crossing,
                   std::span<std::uint64_t> counts) {
    std::vector<std::size_t> places;
    std::vector<mray::Ray> touching;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        if (!take_border_flag(counts[i], crossing)) continue;
        places.push_back(i);
        touching.push_back(rays[i]);
    }
    const std::vector<std::vector<mray::Hit>> crossings = list_crossings(scene, touching);
    for (std::size_t k = 0; k < places.size(); ++k) counts[places[k]] = crossings[k].size();
}

/// Makes lists of each hit, with kTouchesBorder, those of options.crossing. Only rays with more
/// hits than are listed are traced again.
void finish_lists(const SceneImpl& scene, std::span<const mray::Ray> rays,
                  const AllHitsOptions& options, mray::HitLists& lists) {
    std::vector<bool> touches(rays.size());
    std::vector<mray::Ray> cut;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        touches[i] = take_border_flag(lists.total[i], options.crossing);
        if (touches[i] && lists.total[i] > lists.listed[i]) cut.push_back(rays[i]);
    }
    if (std::ranges::find(touches, true) == touches.end()) return;
    std::vector<std::vector<mray::Hit>> crossings = list_crossings(scene, cut);
    auto whole = crossings.begin();
    std::vector<mray::Hit> finished;
    std::vector<mray::Hit> hits;
    auto next = lists.hits.cbegin();
    for (std::size_t i = 0; i < rays.size(); ++i) {
        hits.assign(next, next + lists.listed[i]);
        next += lists.listed[i];
        if (touches[i]) {
            if (lists.total[i] > lists.listed[i])
                hits = std::move(*whole++);
            else
                keep_crossings(scene, rays[i], hits);
            lists.total[i] = hits.size();
            hits.resize(std::min<std::size_t>(hits.size(), options.max_hits));
            lists.listed[i] = static_cast<std::uint32_t>(hits.size());
        }
        finished.insert(finished.end(), hits.begin(), hits.end());
    }
    lists.hits = std::move(finished);
}

/// The first hit after a cursor by Crossing::once, if `found` is that by Crossing::each.
mray::Hit next_crossing(const SceneImpl& scene, const mray::Ray& ray, const mray::HitCursor& after,
                        const mray::Hit& found) {
    if (found.prim_id == mray::kNoPrim || !mray::may_touch_border({found.t, found.u, found.v}))
        return found;
    const std::vector<std::vector<mray::Hit>> lists = list_crossings(scene, {&ray, 1});
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

/// Rays in scene space, and what their t is multiplied by.
struct SceneBatch {
    std::vector<mray::Ray> rays;
    std::vector<int> t_exponents;

    SceneBatch(const detail::RaySpace& space, std::span<const Ray> world) {
        rays.reserve(world.size());
        t_exponents.reserve(world.size());
        detail::for_runs_of(0, world.size(), nullptr, [&](std::size_t first, std::size_t count) {
            mray::cpu::SceneRays run;
            space.to_scene(world.subspan(first, count), run);
            rays.insert(rays.end(), run.rays, run.rays + count);
            for (std::size_t i = 0; i < count; ++i)
                t_exponents.push_back(run.t_exponents[2 * i + 1]);
        });
    }
};

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

/// Answers one ray by find(ray, t_exponent), in scene space.
template <class Find>
Hit ask_one(SceneImpl& scene, const Ray& ray, Find find) {
    Hit hit;
    ask_in_parts(scene, 1, nullptr, [&](std::size_t, std::size_t) {
        mray::Ray asked;
        const std::optional<int> t_exponent = scene.space->to_scene(ray, asked);
        if (!t_exponent) return;
        hit = to_world(scene.meshes, *scene.space, ray, find(asked, *t_exponent), *t_exponent);
    });
    return hit;
}

}  // namespace

void Scene::count(std::span<const Ray> rays, std::span<std::uint64_t> counts, Crossing crossing,
                  Coherence coherence, const std::atomic<bool>* cancel) const {
    with_scene(impl_, [&](SceneImpl& scene) {
        require_room(rays.size(), "rays", counts.size());
        const auto count_part = [&](std::size_t first, std::span<const Ray> part,
                                    std::span<const std::uint32_t> order) {
            ask_in_parts(scene, part.size(), cancel, [&](std::size_t begin, std::size_t size) {
                const auto place = [&](std::size_t i) {
                    return order.empty() ? begin + i : order[begin + i];
                };
                std::vector<Ray> gathered(order.empty() ? 0 : size);
                for (std::size_t i = 0; i < gathered.size(); ++i) gathered[i] = part[place(i)];
                const SceneBatch batch(
                    *scene.space, order.empty() ? part.subspan(begin, size) : std::span(gathered));
                std::vector<std::uint64_t> found(size);
                scene.tracer->query(mray::CountQuery{batch.rays, crossing_of(crossing), found});
                finish_counts(scene, batch.rays, crossing, found);
                for (std::size_t i = 0; i < size; ++i) counts[first + place(i)] = found[i];
            });
        };
        const bool sorts = coherence.kind == Coherence::Kind::sort;
        constexpr std::uint32_t kMostTiled = std::numeric_limits<std::uint32_t>::max();
        if (coherence.kind == Coherence::Kind::image && rays.size() <= kMostTiled) {
            count_part(0, rays, tiled_places(coherence.width, rays.size()));
        } else {
            detail::for_ordered_parts(scene, rays, sorts, detail::RaySorter::kMost, &scene.arena(),
                                      cancel, count_part);
        }
        detail::throw_if_cancelled(cancel);
    });
}

AllHits Scene::intersect_all(std::span<const Ray> rays, const AllHitsOptions& options) const {
    /// The answers of rays from `first` on.
    struct Part {
        std::size_t first;
        std::vector<std::uint32_t> listed;
        std::vector<std::uint64_t> total;
        std::vector<Hit> hits;
    };
    return with_scene(impl_, [&](SceneImpl& scene) {
        std::mutex mutex;
        std::vector<Part> parts;
        ask_in_parts(scene, rays.size(), options.cancel, [&](std::size_t begin, std::size_t size) {
            const SceneBatch batch(*scene.space, rays.subspan(begin, size));
            mray::HitLists lists;
            scene.tracer->query(mray::ListQuery{batch.rays, crossing_of(options.crossing),
                                                options.max_hits, lists});
            finish_lists(scene, batch.rays, options, lists);
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

Hit Scene::intersect(const Ray& ray, const Hit& after, Crossing crossing) const {
    return with_scene(impl_, [&](SceneImpl& scene) -> Hit {
        if (std::isnan(after.t)) throw_bad_argument("after: its t is NaN");
        if (!after) return {};
        return ask_one(scene, ray, [&](const mray::Ray& asked, int t_exponent) {
            mray::HitCursor cursor;
            const std::uint32_t passed = scene.meshes.count_up_to(after.geom_id, after.prim_id);
            cursor.t = scene_t(scene, ray, asked, t_exponent, after.t, passed);
            if (passed != 0) {
                cursor.prim_id = passed - 1;
            } else {  // All hits at this t come after it.
                cursor.t = std::nextafter(cursor.t, -std::numeric_limits<float>::infinity());
                cursor.prim_id = mray::kNoPrim;
            }
            mray::Hit found;
            scene.tracer->query(
                mray::NextQuery{{&asked, 1}, {&cursor, 1}, crossing_of(crossing), {&found, 1}});
            return crossing == Crossing::once ? next_crossing(scene, asked, cursor, found) : found;
        });
    });
}

Hit Scene::intersect_visible(const Ray& ray, std::span<const std::uint8_t> is_visible) const {
    return with_scene(impl_, [&](SceneImpl& scene) {
        return ask_one(scene, ray, [&](const mray::Ray& asked, int) {
            mray::Hit found;
            scene.tracer->query(
                mray::VisibleQuery{{&asked, 1}, scene.meshes.visible(is_visible), {&found, 1}});
            return found;
        });
    });
}

}  // namespace morphray
