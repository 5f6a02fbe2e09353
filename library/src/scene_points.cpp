// The members of Scene that answer queries about points.
#include <cmath>

#include "common/base/errors.h"
#include "common/bvh/exact_closest.h"
#include "common/scene/exact_crossing.h"
#include "cpu/queries/tree_queries.h"
#include "cpu/simd/rounding_bounds.h"
#include "library/src/query_batches.h"
#include "library/src/query_filter.h"

namespace morphray {
namespace {

using namespace detail;

constexpr float kInfinity = std::numeric_limits<float>::infinity();
// Points that are converted and ordered together, which cannot be cancelled.
constexpr std::size_t kMostPoints = std::size_t{1} << 20;
// Up to this number points are answered in the order given.
constexpr std::size_t kFewPoints = 64;
// Signed distances up to this part of the size of scene and point are exact: more than 2^-16 of the
// distance of any corner, and the rule's excess.
constexpr double kNearPart = 0x1p-14;

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
    mray::dvec3 point;
    /// In world space.
    float distance = kInfinity;
    float u;
    float v;
    Feature feature;
};

/// At most the largest float, and 0 for 0 alone.
float in_floats(double distance) {
    using Limits = std::numeric_limits<float>;
    if (distance == 0) return 0;
    return static_cast<float>(std::clamp<double>(distance, Limits::denorm_min(), Limits::max()));
}

double largest_of(const mray::dvec3& p) {
    return std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)});
}

/// Whether tracers find the closest triangle of a point.
bool is_within(const mray::dvec3& p) { return largest_of(p) <= kMostPoint; }

/// Points in scene space; those that are not finite have is_finite 0 and some place.
struct ScenePoints {
    std::span<const Vec3> world;
    QueryFilter filter;
    std::vector<mray::vec3> points;
    /// Before they were rounded, or brought nearer.
    std::vector<mray::dvec3> exact;
    std::vector<std::uint8_t> is_finite;
    /// The order of the queries; empty for the one given.
    std::vector<std::uint32_t> order;
    /// SceneImpl::meshes_of_subtrees(), or empty.
    std::span<const std::uint32_t> meshes = {};

    ScenePoints(const RaySpace& space, std::span<const Vec3> asked, const QueryFilter& seen,
                PointOrder by)
        : world(asked), filter(seen) {
        points.resize(world.size(), mray::vec3(0, 0, 0));
        exact.resize(world.size(), mray::dvec3(0, 0, 0));
        is_finite.resize(world.size());
        for (std::size_t i = 0; i < world.size(); ++i) {
            const Vec3& p = world[i];
            is_finite[i] = std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z) ? 1 : 0;
            if (is_finite[i] != 0) space.to_scene(p, exact[i], points[i]);
        }
        sort(by);
    }
    void sort(PointOrder by) {
        if (points.size() > kFewPoints) order = order_points(points, by);
    }
};

/// Calls work(points, answers) for blocks of points, sorted `by`. Throws Error for wrong options.
template <class Answer, class Work>
void for_blocks(SceneImpl& scene, std::span<const Vec3> points, std::span<Answer> answers,
                PointOrder by, const QueryOptions& options, Work work) {
    require_room(points.size(), "points", answers.size());
    const QueryFilter filter(scene.meshes(), points.size(), "points", options);
    const mray::Watch watch(options.cancel);
    for_runs_of(
        0, points.size(), watch,
        [&](std::size_t first, std::size_t count) {
            ScenePoints block(scene.space(), points.subspan(first, count), filter.from(first), by);
            if (filter.hides_meshes()) block.meshes = scene.meshes_of_subtrees();
            work(block, answers.subspan(first, count));
        },
        kMostPoints);
    watch.throw_if_cancelled();
}

/// Calls find(points, answers, index) for the points [begin, begin + size) in their order, where
/// points[i] has the number index(i) among all, and visit(i, answer) for each that is finite.
template <class Answer, class Find, class Visit>
void query_ordered(const ScenePoints& points, std::size_t begin, std::size_t size, Find find,
                   Visit visit) {
    std::vector<mray::vec3> ordered(size);
    std::vector<Answer> answers(size);
    const auto index = [&](std::size_t i) {
        return points.order.empty() ? begin + i : points.order[begin + i];
    };
    for (std::size_t i = 0; i < size; ++i) ordered[i] = points.points[index(i)];
    find(std::span<const mray::vec3>(ordered), std::span(answers), index);
    for (std::size_t i = 0; i < size; ++i)
        if (points.is_finite[index(i)] != 0) visit(index(i), answers[i]);
}

/// Calls query(begin, size) for parts of the points: in the host's threads, with its tree, if
/// `on_host` or if they do not see all; else where the tracer answers.
template <class Query>
void query_points(SceneImpl& scene, const ScenePoints& points, const QueryOptions& options,
                  Query query, bool on_host = false) {
    const std::size_t total = points.points.size();
    if (!on_host && points.filter.sees_all()) return query_tracer(scene, total, options, query);
    scene.fetch_tree();
    query_on_host(scene, total, options, query);
}
/// Answers the points index(i) within query_points().
template <class Query, class Index>
void answer(SceneImpl& scene, Query query, const ScenePoints& points, Index index,
            bool on_host = false) {
    const mray::SeesTriangle sees = points.filter.seen_by(index);
    const mray::HidesSubtree hides = points.filter.hidden_from(index, points.meshes);
    if (sees) query.sees = &sees;
    if (hides) query.hides = &hides;
    const bool by_tracer = scene.tracer().info().answers_threads || (!on_host && !sees);
    if (by_tracer) return scene.tracer().query(query);
    mray::cpu::TreeQueries(scene.tracer().host_tree(), scene.target())(query);
}

mray::vec3 to_vector(const Vec3& p) { return {p.x, p.y, p.z}; }

mray::Corners world_corners(const SceneImpl& scene, std::uint32_t prim_id) {
    const mray::uvec3 t = scene.meshes().topology().triangles[prim_id];
    return {scene.pose().world_position(t.x), scene.pose().world_position(t.y),
            scene.pose().world_position(t.z)};
}

/// Finds crossings exactly, and calls visit(i, winding) for each point that is finite.
template <class Visit>
void wind(SceneImpl& scene, const ScenePoints& points, const QueryOptions& options, Visit visit) {
    const mray::Watch watch(options.cancel);
    const auto find = [&](auto asked, auto answers, auto index) {
        std::vector<mray::FloatWinding> windings(asked.size());
        std::vector<mray::UncertainCrossing> uncertain;
        answer(scene, mray::WindingQuery{asked, windings, uncertain, watch}, points, index);
        for (std::size_t i = 0; i < answers.size(); ++i)
            answers[i] = {windings[i].winding, windings[i].crossings, false};
        for (const mray::UncertainCrossing& one : uncertain) {
            watch.throw_if_cancelled();
            const std::size_t at = index(one.point);
            if (points.is_finite[at] == 0) continue;
            const auto& [a, b, c] = world_corners(scene, one.prim_id);
            answers[one.point].add(mray::exact_crossing(to_vector(points.world[at]), a, b, c));
        }
    };
    query_points(scene, points, options, [&](std::size_t begin, std::size_t size) {
        query_ordered<PointWinding>(points, begin, size, find, visit);
    });
}

/// At least the squares of distances by the rule, in scene space, of triangles that are no farther
/// than max_distance. Throws Error for a max_distance that is negative or NaN.
float most_d2(const SceneImpl& scene, float max_distance) {
    if (!(max_distance >= 0)) throw_bad_argument("max_distance: {} is not 0 or more", max_distance);
    // The next float, because distances are rounded; then a little more than its square.
    const double exact =
        scene.pose().space().length_to_scene(std::nextafter(max_distance, kInfinity));
    // The largest coordinate of a corner relative to a point so near; the point's own is smaller.
    const double size = 2 * mray::kSceneExtent + exact;
    const double most = exact + size * (mray::cpu::kRuleExcess + mray::cpu::kPointRounding);
    return static_cast<float>(std::min(most * most * (1 + 0x1p-20), double{mray::kAnyDistance2}));
}

/// The exactly closest triangle that the point p, of this number, sees; or kNoPrim. If p is within,
/// it is one of `rivals`.
mray::NumberedTriangle closest_triangle(const mray::Bvh& tree, const mray::dvec3& p,
                                        std::span<const mray::NumberedTriangle> rivals,
                                        const mray::SeesTriangle& sees, std::size_t number) {
    if (is_within(p)) {
        if (rivals.empty()) return {mray::kNoPrim, {}};
        const bool are_too_many = rivals.front().prim_id == mray::kNoPrim;
        if (!are_too_many) return mray::exact_closest(p, rivals);
    }
    return mray::exact_closest(tree, p, sees, number);
}

/// Sets the place on a triangle that is the closest one to the point p, which is `world`. A copy of
/// the place would wait for the stores to it.
void place_on(const SceneImpl& scene, const mray::NumberedTriangle& triangle, const mray::dvec3& p,
              const Vec3& world, PlacedTriangle& placed) {
    const mray::ExactPlace place = mray::exact_place(p, triangle.corners);
    double distance = mray::distance_in_doubles(p, triangle.corners, place.weights);
    // Nearer, the rounding of coordinates to the grid of scene space may count.
    distance = distance >= 0x1p-14
                   ? scene.pose().space().length_to_world(distance)
                   : mray::exact_distance_of(mray::dvec3(to_vector(world)),
                                             world_corners(scene, triangle.prim_id));
    const auto& [first, second, third] = place.weights;
    const auto zeros = std::ranges::count(place.weights, 0.0);
    placed.prim_id = triangle.prim_id;
    placed.point = place.point;
    placed.distance = in_floats(distance);
    placed.u = static_cast<float>(second);
    placed.v = static_cast<float>(third);
    placed.feature = zeros == 0 ? Feature::face : zeros == 1 ? Feature::edge : Feature::vertex;
    // On an edge without the first corner their sum is 1 in floats, too.
    if (first == 0) (second < third ? placed.v : placed.u) = 1.0f - std::min(placed.u, placed.v);
}

/// Finds the exactly closest triangles of the points index(i), and the places on them.
template <class Index>
void find_places(SceneImpl& scene, const ScenePoints& asked, std::span<const mray::vec3> run,
                 Index index, float most_d2, const mray::Watch& watch,
                 std::span<PlacedTriangle> placed) {
    const mray::Bvh& tree = scene.tracer().host_tree();
    mray::Rivals rivals;
    rivals.triangles.reserve(run.size());
    const mray::SeesTriangle sees = asked.filter.seen_by(index);
    // Together, since the loop below would wait for each.
    std::vector<mray::dvec3> exact(run.size());
    for (std::size_t i = 0; i < run.size(); ++i) exact[i] = asked.exact[index(i)];
    answer(scene, mray::ClosestQuery{run, most_d2, {}, watch, &rivals, exact}, asked, index, true);
    std::size_t first = 0;
    for (std::size_t i = 0; i < run.size(); ++i) {
        watch.throw_if_cancelled();
        const auto own = std::span(rivals.triangles).subspan(first, rivals.ends[i] - first);
        first = rivals.ends[i];
        const mray::NumberedTriangle closest = closest_triangle(tree, exact[i], own, sees, i);
        if (closest.prim_id != mray::kNoPrim && asked.is_finite[index(i)] != 0)
            place_on(scene, closest, exact[i], asked.world[index(i)], placed[i]);
    }
}

/// Finds the distances of the closest triangles of `run`; infinite if there is none. Near a surface
/// and far away they are those of exact places, else those of the rule, which is faster.
template <class Index>
void find_distances(SceneImpl& scene, const ScenePoints& asked, std::span<const mray::vec3> run,
                    Index index, float most_d2, const mray::Watch& watch,
                    std::span<float> distances) {
    std::vector<mray::ClosestTriangle> found(run.size());
    answer(scene, mray::ClosestQuery{run, most_d2, found, watch}, asked, index);
    std::vector<mray::vec3> near;
    std::vector<std::size_t> near_numbers;
    float most_near_d2 = 0;
    for (std::size_t i = 0; i < run.size(); ++i) {
        const mray::dvec3& p = asked.exact[index(i)];
        const bool is_none = found[i].prim_id == mray::kNoPrim;
        const double distance = is_none ? kInfinity : std::sqrt(double{found[i].d2});
        if (!is_within(p)) {
            near_numbers.push_back(i);
        } else if (distance <= kNearPart * (mray::kSceneExtent + largest_of(p))) {
            near_numbers.push_back(i);
            most_near_d2 = std::max(most_near_d2, found[i].d2);
        } else {
            distances[i] =
                is_none ? kInfinity : in_floats(scene.pose().space().length_to_world(distance));
        }
    }
    if (near_numbers.empty()) return;
    for (const std::size_t i : near_numbers) near.push_back(run[i]);
    std::vector<PlacedTriangle> placed(near.size());
    find_places(
        scene, asked, near, [&](std::size_t i) { return index(near_numbers[i]); }, most_near_d2,
        watch, std::span(placed));
    for (std::size_t i = 0; i < near.size(); ++i) distances[near_numbers[i]] = placed[i].distance;
}

/// `scale` is the length in world space of 1 in scene space.
ClosestPoint to_world(const SceneImpl& scene, const PlacedTriangle& place, double scale) {
    float world[3];
    for (int axis = 0; axis < 3; ++axis) {
        world[axis] =
            static_cast<float>(place.point[axis] * scale + scene.pose().space().centre(axis));
    }
    const Hit hit = scene.meshes().locate(0, place.u, place.v, place.prim_id);
    return {.point = {world[0], world[1], world[2]},
            .distance = place.distance,
            .u = place.u,
            .v = place.v,
            .prim_id = hit.prim_id,
            .geom_id = hit.geom_id,
            .feature = place.feature};
}

}  // namespace

void Scene::winding(std::span<const Vec3> points, std::span<std::int32_t> windings,
                    const QueryOptions& options) const {
    with_scene(impl_, [&](SceneImpl& scene) {
        const auto find = [&](const ScenePoints& asked, auto answers) {
            std::ranges::fill(answers, 0);
            wind(scene, asked, options,
                 [&](std::size_t i, const PointWinding& winding) { answers[i] = winding.winding; });
        };
        for_blocks(scene, points, windings, PointOrder::columns, options, find);
    });
}

void Scene::contains(std::span<const Vec3> points, std::span<std::uint8_t> inside, FillRule rule,
                     const QueryOptions& options) const {
    with_scene(impl_, [&](SceneImpl& scene) {
        const auto find = [&](const ScenePoints& asked, auto answers) {
            std::ranges::fill(answers, std::uint8_t{0});
            wind(scene, asked, options, [&](std::size_t i, const PointWinding& winding) {
                answers[i] = winding.is_inside(rule) ? 1 : 0;
            });
        };
        for_blocks(scene, points, inside, PointOrder::columns, options, find);
    });
}

void Scene::closest_points(std::span<const Vec3> points, std::span<ClosestPoint> closest,
                           float max_distance, const QueryOptions& options) const {
    with_scene(impl_, [&](SceneImpl& scene) {
        const float most = most_d2(scene, max_distance);
        const mray::Watch watch(options.cancel);
        const double scale = scene.pose().space().length_to_world(1);
        const auto find_block = [&](const ScenePoints& asked, auto answers) {
            std::ranges::fill(answers, ClosestPoint{});
            const auto find = [&](auto run, auto placed, auto index) {
                find_places(scene, asked, run, index, most, watch, placed);
            };
            const auto visit = [&](std::size_t i, const PlacedTriangle& found) {
                if (found.prim_id != mray::kNoPrim && found.distance <= max_distance)
                    answers[i] = to_world(scene, found, scale);
            };
            const auto query = [&](std::size_t begin, std::size_t size) {
                query_ordered<PlacedTriangle>(asked, begin, size, find, visit);
            };
            query_points(scene, asked, options, query, true);
        };
        for_blocks(scene, points, closest, PointOrder::places, options, find_block);
    });
}

void Scene::signed_distance(std::span<const Vec3> points, std::span<float> distances, FillRule rule,
                            float max_distance, const QueryOptions& options) const {
    with_scene(impl_, [&](SceneImpl& scene) {
        const float most = most_d2(scene, max_distance);
        const mray::Watch watch(options.cancel);
        const auto find_block = [&](ScenePoints& asked, auto answers) {
            for (std::size_t i = 0; i < answers.size(); ++i)
                answers[i] = asked.is_finite[i] != 0 ? kInfinity : std::nanf("");
            const auto find = [&](auto run, auto found, auto index) {
                find_distances(scene, asked, run, index, most, watch, found);
            };
            const auto visit = [&](std::size_t i, float found) {
                if (found <= max_distance) answers[i] = found;
            };
            query_points(scene, asked, options, [&](std::size_t begin, std::size_t size) {
                query_ordered<float>(asked, begin, size, find, visit);
            });
            asked.sort(PointOrder::columns);
            wind(scene, asked, options, [&](std::size_t i, const PointWinding& winding) {
                if (winding.is_inside(rule)) answers[i] = winding.is_on_surface ? 0 : -answers[i];
            });
        };
        for_blocks(scene, points, distances, PointOrder::places, options, find_block);
    });
}

}  // namespace morphray
