// The closest points of the meshes, and signed distances: an ExactClosestQuery in scene space where
// the place counts, else a ClosestQuery. Signs are those of windings.
#include <cmath>

#include "common/bvh/exact_closest.h"
#include "library/src/windings.h"

namespace morphray {
namespace {

using namespace detail;

constexpr float kInfinity = std::numeric_limits<float>::infinity();
// Signed distances up to this part of the size of scene and point are exact: more than 2^-16 of the
// distance of any corner, and the rule's excess.
constexpr double kNearPart = 0x1p-14;

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

mray::Corners world_corners(const SceneImpl& scene, std::uint32_t prim_id) {
    const mray::uvec3 t = scene.meshes().topology().triangles[prim_id];
    return {scene.pose().world_position(t.x), scene.pose().world_position(t.y),
            scene.pose().world_position(t.z)};
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
    const double most = exact + size * (mray::kRuleExcess + mray::kPointRounding);
    return static_cast<float>(std::min(most * most * (1 + 0x1p-20), double{mray::kAnyDistance2}));
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

/// Finds the exactly closest triangles of points, and the places on them; none of a point that is
/// not finite.
std::vector<PlacedTriangle> find_places(const PointPart& part, float most_d2) {
    // Together, since the loop below would wait for each.
    std::vector<mray::dvec3> exact(part.size());
    for (std::size_t i = 0; i < part.size(); ++i) exact[i] = part.exact(i);
    std::vector<mray::NumberedTriangle> closest(part.size());
    part.ask(mray::ExactClosestQuery{part.points, exact, most_d2, closest});
    std::vector<PlacedTriangle> placed(part.size());
    for (std::size_t i = 0; i < part.size(); ++i) {
        part.watch().throw_if_cancelled();
        if (closest[i].prim_id != mray::kNoPrim && part.is_finite(i))
            place_on(part.scene, closest[i], exact[i], part.world(i), placed[i]);
    }
    return placed;
}

/// Finds the distances of the closest triangles; infinite if there is none. Near a surface and far
/// away they are those of exact places, else those of the rule, which is faster.
std::vector<float> find_distances(const PointPart& part, float most_d2) {
    const mray::SceneSpace& space = part.scene.pose().space();
    std::vector<mray::ClosestTriangle> found(part.size());
    part.ask(mray::ClosestQuery{part.points, most_d2, found});
    std::vector<float> distances(part.size());
    std::vector<std::size_t> near, near_numbers;
    float most_near_d2 = 0;
    for (std::size_t i = 0; i < part.size(); ++i) {
        const mray::dvec3& p = part.exact(i);
        const bool is_none = found[i].prim_id == mray::kNoPrim;
        const double distance = is_none ? kInfinity : std::sqrt(double{found[i].d2});
        const bool is_near = distance <= kNearPart * (mray::kSceneExtent + largest_of(p));
        if (mray::is_within(p) && !is_near) {
            distances[i] = is_none ? kInfinity : in_floats(space.length_to_world(distance));
            continue;
        }
        near.push_back(i);
        near_numbers.push_back(part.numbers[i]);
        if (mray::is_within(p)) most_near_d2 = std::max(most_near_d2, found[i].d2);
    }
    if (near.empty()) return distances;
    const PointPart near_part(part.block, std::move(near_numbers));
    const std::vector<PlacedTriangle> placed = find_places(near_part, most_near_d2);
    for (std::size_t i = 0; i < near.size(); ++i) distances[near[i]] = placed[i].distance;
    return distances;
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

void Scene::closest_points(std::span<const Vec3> points, std::span<ClosestPoint> closest,
                           float max_distance, const QueryOptions& options) const {
    with_scene(impl_, [&](SceneImpl& scene) {
        const float most = most_d2(scene, max_distance);
        const double scale = scene.pose().space().length_to_world(1);
        const auto find = [&](const PointPart& part) {
            const std::vector<PlacedTriangle> found = find_places(part, most);
            for (std::size_t i = 0; i < part.size(); ++i) {
                const bool is_there =
                    found[i].prim_id != mray::kNoPrim && found[i].distance <= max_distance;
                closest[part.numbers[i]] =
                    is_there ? to_world(scene, found[i], scale) : ClosestPoint{};
            }
        };
        for_point_blocks(scene, points, closest.size(), options, [&](const PointBlock& block) {
            block.for_parts<mray::ExactClosestQuery>(PointOrder::places, find);
        });
    });
}

void Scene::signed_distance(std::span<const Vec3> points, std::span<float> distances, FillRule rule,
                            float max_distance, const QueryOptions& options) const {
    with_scene(impl_, [&](SceneImpl& scene) {
        const float most = most_d2(scene, max_distance);
        const auto find = [&](const PointPart& part) {
            const std::vector<float> found = find_distances(part, most);
            for (std::size_t i = 0; i < part.size(); ++i) {
                const float distance = found[i] <= max_distance ? found[i] : kInfinity;
                distances[part.numbers[i]] = part.is_finite(i) ? distance : std::nanf("");
            }
        };
        const auto turn_inside = [&](std::size_t number, const PointWinding& winding) {
            if (!winding.is_inside(rule)) return;
            distances[number] = winding.is_on_surface ? 0 : -distances[number];
        };
        for_point_blocks(scene, points, distances.size(), options, [&](const PointBlock& block) {
            block.for_parts<mray::ClosestQuery>(PointOrder::places, find);
            find_windings(block, turn_inside);
        });
    });
}

}  // namespace morphray
