#include "library/src/windings.h"

#include "common/scene/exact_crossing.h"

namespace morphray {
namespace detail {
namespace {

void add_exact(const PointPart& part, const mray::UncertainCrossing& one, PointWinding& winding) {
    const PoseReader& pose = part.scene.pose();
    const mray::uvec3 t = part.scene.meshes().topology().triangles[one.prim_id];
    const mray::ExactCrossing crossing =
        mray::exact_crossing(to_vector(part.world(one.point)), pose.world_position(t.x),
                             pose.world_position(t.y), pose.world_position(t.z));
    winding.winding += crossing.sign;
    winding.crossings += crossing.sign != 0;
    winding.is_on_surface |= crossing.is_on_triangle;
}

}  // namespace

void find_windings(const PointBlock& block,
                   const std::function<void(std::size_t number, const PointWinding&)>& visit) {
    const auto find = [&](const PointPart& part) {
        std::vector<mray::FloatWinding> found(part.size());
        std::vector<mray::UncertainCrossing> uncertain;
        part.ask(mray::WindingQuery{part.points, found, uncertain});
        std::vector<PointWinding> exact;
        for (const auto& [winding, crossings] : found) exact.push_back({winding, crossings});
        for (const mray::UncertainCrossing& one : uncertain) {
            part.watch().throw_if_cancelled();
            if (part.is_finite(one.point)) add_exact(part, one, exact[one.point]);
        }
        for (std::size_t i = 0; i < part.size(); ++i)
            visit(part.numbers[i], part.is_finite(i) ? exact[i] : PointWinding{});
    };
    block.for_parts<mray::WindingQuery>(PointOrder::columns, find);
}

}  // namespace detail

using namespace detail;

void Scene::winding(std::span<const Vec3> points, std::span<std::int32_t> windings,
                    const QueryOptions& options) const {
    with_scene(impl_, [&](SceneImpl& scene) {
        for_point_blocks(scene, points, windings.size(), options, [&](const PointBlock& block) {
            find_windings(block, [&](std::size_t number, const PointWinding& found) {
                windings[number] = found.winding;
            });
        });
    });
}

void Scene::contains(std::span<const Vec3> points, std::span<std::uint8_t> inside, FillRule rule,
                     const QueryOptions& options) const {
    with_scene(impl_, [&](SceneImpl& scene) {
        for_point_blocks(scene, points, inside.size(), options, [&](const PointBlock& block) {
            find_windings(block, [&](std::size_t number, const PointWinding& found) {
                inside[number] = found.is_inside(rule) ? 1 : 0;
            });
        });
    });
}

}  // namespace morphray
