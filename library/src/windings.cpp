// How often the meshes wind around points, and so the sides of points: a WindingQuery in scene
// space, and what it leaves uncertain exactly, in world space.
#include <cmath>

#include "common/scene/exact_crossing.h"
#include "library/src/closest_points.h"

namespace morphray {
namespace {

using namespace detail;

struct PointWinding : mray::FloatWinding {
    bool is_on_surface = false;

    bool is_inside(FillRule rule) const {
        if (is_on_surface) return true;
        return rule == FillRule::nonzero ? winding != 0 : (crossings & 1) != 0;
    }
};

void add_exact(const PointPart& part, const mray::UncertainCrossing& one, PointWinding& winding) {
    const PoseReader& pose = part.scene.pose();
    const mray::uvec3 t = part.scene.meshes().topology().triangles[one.prim_id];
    const mray::ExactCrossing crossing = mray::exact_crossing(
        to_vector(part.world[part.numbers[one.point]]), pose.world_position(t.x),
        pose.world_position(t.y), pose.world_position(t.z));
    winding.winding += crossing.sign;
    winding.crossings += crossing.sign != 0;
    winding.is_on_surface |= crossing.is_on_triangle;
}

/// Calls visit(number, winding) for all points in many threads; those that are not finite have no
/// crossing.
template <class Visit>
void find_windings(SceneImpl& scene, std::span<const Vec3> points, QueryFilter& filter,
                   Visit visit) {
    const auto find = [&](const PointPart& part) {
        std::vector<mray::FloatWinding> found(part.size());
        std::vector<mray::UncertainCrossing> uncertain;
        part.ask(mray::WindingQuery{part.points, found, uncertain});
        std::vector<PointWinding> exact;
        for (const mray::FloatWinding& winding : found) exact.push_back({winding});
        for (const mray::UncertainCrossing& one : uncertain) {
            part.watch().throw_if_cancelled();
            if (part.is_finite[one.point] != 0) add_exact(part, one, exact[one.point]);
        }
        for (std::size_t i = 0; i < part.size(); ++i)
            visit(part.numbers[i], part.is_finite[i] != 0 ? exact[i] : PointWinding{});
    };
    for_point_parts<mray::WindingQuery>(scene, points, filter, PointOrder::columns, find);
}

}  // namespace

void Scene::winding(std::span<const Vec3> points, std::span<std::int32_t> windings,
                    const QueryOptions& options) const {
    with_scene(impl_, [&](SceneImpl& scene) {
        QueryFilter filter(scene, points.size(), "points", windings.size(), options);
        find_windings(scene, points, filter, [&](std::size_t number, const PointWinding& found) {
            windings[number] = found.winding;
        });
    });
}

void Scene::contains(std::span<const Vec3> points, std::span<std::uint8_t> inside, FillRule rule,
                     const QueryOptions& options) const {
    with_scene(impl_, [&](SceneImpl& scene) {
        QueryFilter filter(scene, points.size(), "points", inside.size(), options);
        find_windings(scene, points, filter, [&](std::size_t number, const PointWinding& found) {
            inside[number] = found.is_inside(rule) ? 1 : 0;
        });
    });
}

void Scene::signed_distance(std::span<const Vec3> points, std::span<float> distances, FillRule rule,
                            float max_distance, const QueryOptions& options) const {
    with_scene(impl_, [&](SceneImpl& scene) {
        QueryFilter filter(scene, points.size(), "points", distances.size(), options);
        const float most = most_d2(scene, max_distance);
        const auto find = [&](const PointPart& part) {
            const std::vector<float> found = find_distances(part, most);
            for (std::size_t i = 0; i < part.size(); ++i) {
                const float distance =
                    found[i] <= max_distance ? found[i] : std::numeric_limits<float>::infinity();
                distances[part.numbers[i]] = part.is_finite[i] != 0 ? distance : std::nanf("");
            }
        };
        const auto turn_inside = [&](std::size_t number, const PointWinding& winding) {
            if (!winding.is_inside(rule)) return;
            distances[number] = winding.is_on_surface ? 0 : -distances[number];
        };
        for_point_parts<mray::ClosestQuery>(scene, points, filter, PointOrder::places, find);
        find_windings(scene, points, filter, turn_inside);
    });
}

}  // namespace morphray
