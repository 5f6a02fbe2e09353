#include "library/src/closest_points.h"

#include <cmath>

#include "common/bvh/exact_closest.h"

namespace morphray {
namespace {

using namespace detail;

constexpr float kInfinity = std::numeric_limits<float>::infinity();
// Signed distances up to this part of the size of scene and point are exact: more than 2^-16 of the
// distance of any corner, and the rule's excess.
constexpr double kNearPart = 0x1p-14;

/// At most the largest float, and 0 for 0 alone.
float in_floats(double distance) {
    using Limits = std::numeric_limits<float>;
    if (distance == 0) return 0;
    return static_cast<float>(std::clamp<double>(distance, Limits::denorm_min(), Limits::max()));
}

mray::Corners world_corners(const SceneImpl& scene, std::uint32_t prim_id) {
    const mray::uvec3 t = scene.meshes().topology().triangles[prim_id];
    return {scene.pose().world_position(t.x), scene.pose().world_position(t.y),
            scene.pose().world_position(t.z)};
}

/// Sets the place on a triangle that is the closest one to the point p, which is `world`. A copy of
/// the place would wait for the stores to it.
void place_on(const SceneImpl& scene, const mray::NumberedTriangle& triangle, const mray::dvec3& p,
              const Vec3& world, ClosestPoint& placed) {
    const mray::SceneSpace& space = scene.pose().space();
    const mray::ExactPlace place = mray::exact_place(p, triangle.corners);
    const auto world_place = [&](int axis) {
        return static_cast<float>(space.length_to_world(place.point[axis]) + space.centre(axis));
    };
    placed.point = {world_place(0), world_place(1), world_place(2)};
    const double distance = mray::distance_in_doubles(p, triangle.corners, place.weights);
    // Nearer, the rounding of coordinates to the grid of scene space may count.
    placed.distance = in_floats(
        distance >= 0x1p-14 ? space.length_to_world(distance)
                            : mray::exact_distance_of(mray::dvec3(to_vector(world)),
                                                      world_corners(scene, triangle.prim_id)));
    const auto& [first, second, third] = place.weights;
    const auto zeros = std::ranges::count(place.weights, 0.0);
    placed.u = static_cast<float>(second);
    placed.v = static_cast<float>(third);
    placed.feature = zeros == 0 ? Feature::face : zeros == 1 ? Feature::edge : Feature::vertex;
    // On an edge without the first corner their sum is 1 in floats, too.
    if (first == 0) (second < third ? placed.v : placed.u) = 1.0f - std::min(placed.u, placed.v);
    const Primitive located = scene.meshes().locate(0, 0, 0, triangle.prim_id).primitive();
    placed.prim_id = located.prim_id;
    placed.geom_id = located.geom_id;
}

/// Finds the exactly closest triangles of points, and the places on them; none of a point that is
/// not finite.
std::vector<ClosestPoint> find_places(const PointPart& part, float most_d2) {
    std::vector<mray::NumberedTriangle> closest(part.size());
    part.ask(mray::ExactClosestQuery{part.points, part.exact, most_d2, closest});
    std::vector<ClosestPoint> placed(part.size());
    for (std::size_t i = 0; i < part.size(); ++i) {
        part.watch().throw_if_cancelled();
        if (closest[i].prim_id != mray::kNoPrim && part.is_finite[i] != 0)
            place_on(part.scene, closest[i], part.exact[i], part.world[part.numbers[i]], placed[i]);
    }
    return placed;
}

}  // namespace

float detail::most_d2(const SceneImpl& scene, float max_distance) {
    if (!(max_distance >= 0)) throw_bad_argument("max_distance: {} is not 0 or more", max_distance);
    // The next float, because distances are rounded; then a little more than its square.
    const double exact =
        scene.pose().space().length_to_scene(std::nextafter(max_distance, kInfinity));
    // The largest coordinate of a corner relative to a point so near; the point's own is smaller.
    const double size = 2 * mray::kSceneExtent + exact;
    const double most = exact + size * (mray::kRuleExcess + mray::kPointRounding);
    return static_cast<float>(std::min(most * most * (1 + 0x1p-20), double{mray::kAnyDistance2}));
}

std::vector<float> detail::find_distances(const PointPart& part, float most_d2) {
    const mray::SceneSpace& space = part.scene.pose().space();
    std::vector<mray::ClosestTriangle> found(part.size());
    part.ask(mray::ClosestQuery{part.points, most_d2, found});
    std::vector<float> distances(part.size());
    std::vector<std::size_t> near;
    float most_near_d2 = 0;
    for (std::size_t i = 0; i < part.size(); ++i) {
        const mray::dvec3& p = part.exact[i];
        const bool is_none = found[i].prim_id == mray::kNoPrim;
        const double distance = is_none ? kInfinity : std::sqrt(double{found[i].d2});
        const double size = std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)});
        const bool is_near = distance <= kNearPart * (mray::kSceneExtent + size);
        if (mray::is_within(p) && !is_near) {
            distances[i] = is_none ? kInfinity : in_floats(space.length_to_world(distance));
            continue;
        }
        near.push_back(i);
        if (mray::is_within(p)) most_near_d2 = std::max(most_near_d2, found[i].d2);
    }
    if (near.empty()) return distances;
    const std::vector<ClosestPoint> placed =
        find_places(PointPart(part.chosen(near), part.world), most_near_d2);
    for (std::size_t i = 0; i < near.size(); ++i) distances[near[i]] = placed[i].distance;
    return distances;
}

void Scene::closest_points(std::span<const Vec3> points, std::span<ClosestPoint> closest,
                           float max_distance, const QueryOptions& options) const {
    with_scene(impl_, [&](SceneImpl& scene) {
        QueryFilter filter(scene, points.size(), "points", closest.size(), options);
        const float most = most_d2(scene, max_distance);
        const auto find = [&](const PointPart& part) {
            const std::vector<ClosestPoint> found = find_places(part, most);
            for (std::size_t i = 0; i < part.size(); ++i)
                closest[part.numbers[i]] =
                    found[i].distance <= max_distance ? found[i] : ClosestPoint{};
        };
        for_point_parts<mray::ExactClosestQuery>(scene, points, filter, PointOrder::places, find);
    });
}

}  // namespace morphray
