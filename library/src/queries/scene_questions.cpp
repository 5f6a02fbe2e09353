#include "library/src/queries/scene_questions.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <mutex>

#include "common/base/errors.h"
#include "common/interop/closest_rule.h"
#include "common/interop/hit_rule.h"
#include "common/scene/exact_crossing.h"
#include "cpu/queries/tree_queries.h"
#include "library/src/queries/point_order.h"
#include "library/src/queries/ray_order.h"
#include "library/src/scene/errors.h"

namespace morphray::detail {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr std::size_t kMostPoints = std::numeric_limits<std::uint32_t>::max();
// Points up to this number are asked about in the order given.
constexpr std::size_t kFewPoints = 64;

mray::Crossing crossing_of(Crossing crossing) {
    return crossing == Crossing::each ? mray::Crossing::kEach : mray::Crossing::kOwner;
}

void require_room(std::size_t questions, const char* what, std::size_t answers) {
    if (questions == answers) return;
    throw_bad_argument(fmt::format("{} {}, but room for {} answers", questions, what, answers));
}

/// The crossings of a half-line from a point.
struct PointWinding {
    std::int32_t winding = 0;
    std::uint32_t crossings = 0;
    bool is_on_surface = false;

    void add(const mray::ExactCrossing& crossing) {
        winding += crossing.sign;
        crossings += crossing.sign != 0;
        is_on_surface |= crossing.is_on_triangle;
    }
    bool is_inside(FillRule rule) const {
        if (is_on_surface) return true;
        return rule == FillRule::nonzero ? winding != 0 : (crossings & 1) != 0;
    }
};

/// The closest triangle of a point, and the place on it.
struct PlacedTriangle {
    std::uint32_t prim_id = mray::kNoPrim;
    mray::NearPoint place;
};

/// In world space, where 1 in scene space is `scale` long.
float distance_of(float d2, double scale) {
    return static_cast<float>(std::sqrt(static_cast<double>(d2)) * scale);
}

/// At most RaySpace::kMost rays in scene space.
struct SceneRun {
    mray::cpu::SceneRays scene;
    std::span<const mray::Ray> rays;

    SceneRun(const RaySpace& space, std::span<const Ray> world) {
        space.to_scene(world, scene);
        rays = std::span(scene.rays).first(world.size());
    }
    int t_exponent(std::size_t ray) const { return scene.t_exponents[2 * ray + 1]; }
};

/// Calls work(first, count) for parts of [0, total) of at most `most`.
template <class Work>
void for_parts(std::size_t total, std::size_t most, Work work) {
    for (std::size_t first = 0; first < total; first += most)
        work(first, std::min(most, total - first));
}

}  // namespace

// ---- Rays

void SceneQuestions::count(std::span<const Ray> rays, std::span<std::uint64_t> counts,
                           Crossing crossing, Coherence coherence,
                           const std::atomic<bool>* cancel) const {
    require_room(rays.size(), "rays", counts.size());
    const auto ask = [&](const mray::SceneQueries& scene, std::span<const Ray> some,
                         std::span<std::uint64_t> counts_of_some) {
        std::vector<mray::Ray> part;
        part.reserve(some.size());
        for_parts(some.size(), RaySpace::kMost, [&](std::size_t first, std::size_t count) {
            const SceneRun run(rays_, some.subspan(first, count));
            part.insert(part.end(), run.rays.begin(), run.rays.end());
        });
        scene.count(part, crossing_of(crossing), counts_of_some);
    };
    /// Asks about `total` rays, whose numbers fill_places(begin, places) tells in an order in which
    /// neighbours are alike.
    const auto ask_in_order = [&](std::size_t total, auto fill_places) {
        queries_.ask(total, cancel,
                     [&](const mray::SceneQueries& scene, std::size_t begin, std::size_t size) {
                         std::vector<std::size_t> places(size);
                         fill_places(begin, std::span(places));
                         std::vector<Ray> some(size);
                         std::vector<std::uint64_t> counts_of_some(size);
                         for (std::size_t i = 0; i < size; ++i) some[i] = rays[places[i]];
                         ask(scene, some, counts_of_some);
                         for (std::size_t i = 0; i < size; ++i)
                             counts[places[i]] = counts_of_some[i];
                     });
    };
    if (is_image(coherence)) {
        ask_in_order(rays.size(), [&](std::size_t begin, std::span<std::size_t> places) {
            find_tiled_places(coherence.width, rays.size(), begin, places);
        });
        return;
    }
    if (queries_.prefers_order() && is_to_sort(rays, coherence)) {
        const mray::cpu::RayCurve curve = curve_of(rays, rays_.extent());
        const mray::cpu::RayKeys keys(curve, rays_.target());
        RaySorter sorter;
        sorter.make_room(std::min(rays.size(), RaySorter::kMost));
        for_parts(rays.size(), RaySorter::kMost, [&](std::size_t first, std::size_t size) {
            const std::span sorted = sorter.sort(rays.subspan(first, size), keys, &arena_);
            ask_in_order(size, [&](std::size_t begin, std::span<std::size_t> places) {
                for (std::size_t i = 0; i < places.size(); ++i)
                    places[i] = first + sorted[begin + i];
            });
        });
        return;
    }
    queries_.ask(rays.size(), cancel,
                 [&](const mray::SceneQueries& scene, std::size_t begin, std::size_t size) {
                     ask(scene, rays.subspan(begin, size), counts.subspan(begin, size));
                 });
}

AllHits SceneQuestions::intersect_all(std::span<const Ray> rays,
                                      const AllHitsOptions& options) const {
    /// The answers of rays from `first` on.
    struct Part {
        std::size_t first;
        std::vector<std::uint32_t> listed;
        std::vector<std::uint64_t> total;
        std::vector<Hit> hits;
    };
    std::mutex mutex;
    std::vector<Part> parts;
    queries_.ask(rays.size(), options.cancel,
                 [&](const mray::SceneQueries& scene, std::size_t begin, std::size_t size) {
                     std::vector<mray::Ray> asked;
                     std::vector<int> t_exponents;
                     for_parts(size, RaySpace::kMost, [&](std::size_t first, std::size_t count) {
                         const SceneRun run(rays_, rays.subspan(begin + first, count));
                         asked.insert(asked.end(), run.rays.begin(), run.rays.end());
                         for (std::size_t i = 0; i < count; ++i)
                             t_exponents.push_back(run.t_exponent(i));
                     });
                     mray::HitLists lists;
                     scene.list(asked, crossing_of(options.crossing), options.max_hits, lists);
                     Part part{begin, std::move(lists.listed), std::move(lists.total), {}};
                     part.hits.reserve(lists.hits.size());
                     auto hit = lists.hits.begin();
                     for (std::size_t i = 0; i < size; ++i) {
                         for (std::uint32_t k = 0; k < part.listed[i]; ++k)
                             part.hits.push_back(rays_.to_world(*hit++, t_exponents[i]));
                     }
                     const std::scoped_lock lock(mutex);
                     parts.push_back(std::move(part));
                 });
    std::sort(parts.begin(), parts.end(),
              [](const Part& a, const Part& b) { return a.first < b.first; });
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
}

/// The t in scene space of a hit of the last one of `passed` triangles. A power of two gives it
/// exactly, unless t is rounded in world space: where it is a denormal, or too large for a float.
/// Then the triangle is asked again.
float SceneQuestions::scene_t(const mray::Ray& ray, int t_exponent, float world_t,
                              std::uint32_t passed) const {
    using Limits = std::numeric_limits<float>;
    const auto t = static_cast<float>(std::ldexp(static_cast<double>(world_t), -t_exponent));
    const bool is_exact = world_t >= Limits::min() && world_t < Limits::max();
    if (is_exact || passed == 0) return t;
    const mray::uvec3 corners = meshes_.topology().triangles[passed - 1];
    const std::span<const mray::vec3> positions = pose_.positions();
    mray::TriangleHit hit;
    const bool is_hit = mray::intersect_triangle(mray::shear_ray(ray.org, ray.dir), ray.tnear,
                                                 ray.tfar, positions[corners.x],
                                                 positions[corners.y], positions[corners.z], hit);
    return is_hit && to_world_t(hit.t, t_exponent) == world_t ? hit.t : t;
}

/// Answers one ray by find(queries, ray, t_exponent), in scene space.
template <class Find>
Hit SceneQuestions::ask_one(const Ray& ray, Find find) const {
    Hit hit;
    queries_.ask(1, nullptr, [&](const mray::SceneQueries& scene, std::size_t, std::size_t) {
        mray::Ray asked;
        const RayScale scale = rays_.to_scene(ray, asked);
        if (!scale.is_valid) return;
        hit = rays_.to_world(find(scene, asked, scale.t_exponent), scale.t_exponent);
    });
    return hit;
}

Hit SceneQuestions::intersect(const Ray& ray, const Hit& after, Crossing crossing) const {
    if (std::isnan(after.t)) throw_bad_argument("after: its t is NaN");
    if (!after) return {};
    return ask_one(
        ray, [&](const mray::SceneQueries& scene, const mray::Ray& asked, int t_exponent) {
            mray::HitCursor cursor;
            const std::uint32_t passed = meshes_.count_up_to(after.geom_id, after.prim_id);
            cursor.t = scene_t(asked, t_exponent, after.t, passed);
            if (passed != 0) {
                cursor.prim_id = passed - 1;
            } else {  // All hits at this t come after it.
                cursor.t = std::nextafter(cursor.t, -kInfinity);
                cursor.prim_id = mray::kNoPrim;
            }
            mray::Hit found;
            scene.intersect_after({&asked, 1}, {&cursor, 1}, crossing_of(crossing), {&found, 1});
            return found;
        });
}

Hit SceneQuestions::intersect_visible(const Ray& ray,
                                      std::span<const std::uint8_t> is_visible) const {
    return ask_one(ray, [&](const mray::SceneQueries& scene, const mray::Ray& asked, int) {
        mray::Hit found;
        scene.intersect_visible({&asked, 1}, meshes_.visible(is_visible), {&found, 1});
        return found;
    });
}

// ---- Points

SceneQuestions::ScenePoints SceneQuestions::to_scene(std::span<const Vec3> points,
                                                     PointOrder order) const {
    if (points.size() > kMostPoints) {
        throw mray::Error(mray::ErrorKind::kLimit,
                          "more than 4294967295 points; ask about fewer at a time");
    }
    ScenePoints result;
    result.points.resize(points.size(), mray::vec3(0, 0, 0));
    result.is_within.resize(points.size());
    for (std::size_t i = 0; i < points.size(); ++i)
        result.is_within[i] = rays_.to_scene(points[i], result.points[i]) ? 1 : 0;
    if (points.size() > kFewPoints) result.order = order_points(result.points, order);
    return result;
}

/// Asks find(scene, points, answers, index) about the points in their order, where index(i) is the
/// number of points[i] among all, and calls visit(i, answer) for each of them that is within reach.
template <class Answer, class Find, class Visit>
void SceneQuestions::ask_points(const ScenePoints& points, const std::atomic<bool>* cancel,
                                Find find, Visit visit) const {
    queries_.ask(points.points.size(), cancel,
                 [&](const mray::SceneQueries& scene, std::size_t begin, std::size_t size) {
                     std::vector<mray::vec3> asked(size);
                     std::vector<Answer> answers(size);
                     const auto index = [&](std::size_t i) {
                         return points.order.empty() ? begin + i : points.order[begin + i];
                     };
                     for (std::size_t i = 0; i < size; ++i) asked[i] = points.points[index(i)];
                     find(scene, std::span<const mray::vec3>(asked), std::span(answers), index);
                     for (std::size_t i = 0; i < size; ++i)
                         if (points.is_within[index(i)] != 0) visit(index(i), answers[i]);
                 });
}

/// Finds the crossings of points, exactly, and calls visit(i, winding) for each of them that is
/// within reach.
template <class Visit>
void SceneQuestions::wind(std::span<const Vec3> world, const ScenePoints& points,
                          const std::atomic<bool>* cancel, Visit visit) const {
    ask_points<PointWinding>(
        points, cancel,
        [&](const mray::SceneQueries& scene, auto asked, auto answers, auto index) {
            std::vector<mray::FloatWinding> windings(asked.size());
            std::vector<mray::UncertainCrossing> uncertain;
            scene.wind(asked, windings, uncertain);
            for (std::size_t i = 0; i < answers.size(); ++i)
                answers[i] = {windings[i].winding, windings[i].crossings, false};
            for (const mray::UncertainCrossing& one : uncertain) {
                const std::size_t at = index(one.point);
                if (points.is_within[at] == 0) continue;
                const mray::uvec3 t = meshes_.topology().triangles[one.prim_id];
                answers[one.point].add(mray::exact_crossing(
                    {world[at].x, world[at].y, world[at].z}, pose_.world_position(t.x),
                    pose_.world_position(t.y), pose_.world_position(t.z)));
            }
        },
        visit);
}

void SceneQuestions::winding(std::span<const Vec3> points, std::span<std::int32_t> windings,
                             const std::atomic<bool>* cancel) const {
    require_room(points.size(), "points", windings.size());
    std::fill(windings.begin(), windings.end(), 0);
    wind(points, to_scene(points, PointOrder::columns), cancel,
         [&](std::size_t i, const PointWinding& winding) { windings[i] = winding.winding; });
}

void SceneQuestions::contains(std::span<const Vec3> points, std::span<std::uint8_t> inside,
                              FillRule rule, const std::atomic<bool>* cancel) const {
    require_room(points.size(), "points", inside.size());
    std::fill(inside.begin(), inside.end(), std::uint8_t{0});
    wind(points, to_scene(points, PointOrder::columns), cancel,
         [&](std::size_t i, const PointWinding& winding) {
             inside[i] = winding.is_inside(rule) ? 1 : 0;
         });
}

/// At least the squares of all distances in scene space that distance_of() takes to max_distance or
/// less. Throws Error for a max_distance that is negative or NaN.
float SceneQuestions::most_d2(float max_distance) const {
    if (!(max_distance >= 0))
        throw_bad_argument(fmt::format("max_distance: {} is not 0 or more", max_distance));
    // The next float, because distances are rounded, by up to a half of them if they are denormals;
    // and a little more than its square.
    const double most = pose_.space().length_to_scene(std::nextafter(max_distance, kInfinity));
    return static_cast<float>(std::min(most * most * (1 + 0x1p-20), double{mray::kAnyDistance2}));
}

/// `scale` is the length in world space of 1 in scene space.
ClosestPoint SceneQuestions::to_world(mray::vec3 point, std::uint32_t prim_id,
                                      const mray::NearPoint& near, double scale) const {
    float world[3];
    for (int axis = 0; axis < 3; ++axis) {
        const double scene = static_cast<double>(point[axis]) + double{near.offset[axis]};
        world[axis] = static_cast<float>(scene * scale + pose_.space().centre(axis));
    }
    const int zeros = (near.u == 0) + (near.v == 0) + (1.0f - (near.u + near.v) <= 0);
    const Hit hit = meshes_.locate(0, near.u, near.v, prim_id);
    return {.point = {world[0], world[1], world[2]},
            .distance = distance_of(near.d2, scale),
            .u = near.u,
            .v = near.v,
            .prim_id = hit.prim_id,
            .geom_id = hit.geom_id,
            .feature = zeros == 0   ? Feature::face
                       : zeros == 1 ? Feature::edge
                                    : Feature::vertex};
}

void SceneQuestions::closest_points(std::span<const Vec3> points, std::span<ClosestPoint> closest,
                                    float max_distance, const std::atomic<bool>* cancel) const {
    require_room(points.size(), "points", closest.size());
    const float most = most_d2(max_distance);
    std::fill(closest.begin(), closest.end(), ClosestPoint{});
    const double scale = pose_.space().length_to_world(1);
    const ScenePoints asked = to_scene(points, PointOrder::places);
    ask_points<PlacedTriangle>(
        asked, cancel,
        [&](const mray::SceneQueries& scene, std::span<const mray::vec3> run, auto answers, auto) {
            std::vector<mray::ClosestTriangle> found(run.size());
            std::vector<mray::NearPoint> places(run.size());
            scene.closest(run, most, found);
            mray::cpu::find_places(rays_.target(), run, found, meshes_.topology().triangles,
                                   pose_.positions(), places);
            for (std::size_t i = 0; i < run.size(); ++i) answers[i] = {found[i].prim_id, places[i]};
        },
        [&](std::size_t i, const PlacedTriangle& found) {
            if (found.prim_id == mray::kNoPrim) return;
            const ClosestPoint place = to_world(asked.points[i], found.prim_id, found.place, scale);
            if (place.distance <= max_distance) closest[i] = place;
        });
}

void SceneQuestions::signed_distance(std::span<const Vec3> points, std::span<float> distances,
                                     FillRule rule, float max_distance,
                                     const std::atomic<bool>* cancel) const {
    require_room(points.size(), "points", distances.size());
    const float most = most_d2(max_distance);
    const auto is_finite = [](const Vec3& p) {
        return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
    };
    for (std::size_t i = 0; i < points.size(); ++i)
        distances[i] = is_finite(points[i]) ? kInfinity : std::numeric_limits<float>::quiet_NaN();
    ScenePoints asked = to_scene(points, PointOrder::places);
    const double scale = pose_.space().length_to_world(1);
    ask_points<mray::ClosestTriangle>(
        asked, cancel,
        [most](const mray::SceneQueries& scene, auto run, auto answers, auto) {
            scene.closest(run, most, answers);
        },
        [&](std::size_t i, const mray::ClosestTriangle& found) {
            if (found.prim_id == mray::kNoPrim) return;
            const float distance = distance_of(found.d2, scale);
            if (distance <= max_distance) distances[i] = distance;
        });
    if (!asked.order.empty()) asked.order = order_points(asked.points, PointOrder::columns);
    wind(points, asked, cancel, [&](std::size_t i, const PointWinding& winding) {
        if (winding.is_on_surface) {
            distances[i] = 0;
        } else if (winding.is_inside(rule)) {
            distances[i] = -distances[i];
        }
    });
}

}  // namespace morphray::detail
