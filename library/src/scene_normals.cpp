// Scene::normals(), and the normals of vertices at the pose.
#include <fmt/format.h>

#include <cmath>
#include <cstddef>

#include <glm/geometric.hpp>

#include "common/interop/lit.h"
#include "library/src/scene_impl.h"

namespace morphray {
namespace detail {

void update_normals(SceneImpl& scene) {
    if (scene.has_normals) return;
    if (!scene.normals)
        scene.normals.emplace(scene.meshes.topology().triangles, scene.meshes.normal_ids());
    scene.arena().execute([&] { scene.normals->update(scene.pose.positions()); });
    scene.has_normals = true;
}

}  // namespace detail

namespace {

using detail::SceneImpl;

/// The unit normal of a triangle; 0 without an area, or with a corner that is not finite.
mray::vec3 flat_normal(const SceneImpl& scene, std::uint32_t prim) {
    const mray::uvec3 corners = scene.meshes.topology().triangles[prim];
    const auto at = [&](std::uint32_t corner) {
        return glm::dvec3(scene.pose.positions()[corner]);
    };
    const glm::dvec3 normal =
        glm::cross(at(corners.y) - at(corners.x), at(corners.z) - at(corners.x));
    const double length = glm::length(normal);
    if (!(length > 0) || !std::isfinite(length)) return {0, 0, 0};
    return mray::vec3(normal / length);
}

/// The normals of the corners of the triangle, interpolated; `flat` where they are not smooth.
mray::vec3 smooth_normal_at(const SceneImpl& scene, std::uint32_t prim, const Hit& hit,
                            mray::vec3 flat) {
    const mray::uvec3 ids = scene.normals->ids()[prim];
    mray::vec3 corners[3];
    for (int k = 0; k < 3; ++k) {
        corners[k] = ids[k] == mray::kFlatCorner
                         ? flat
                         : mray::corner_normal(scene.normals->normals()[ids[k]], flat);
    }
    return mray::smooth_normal(corners[0], corners[1], corners[2], hit.u, hit.v);
}

}  // namespace

void Scene::normals(std::span<const Hit> hits, std::span<Vec3> normals, bool smooth) const {
    detail::with_scene(impl_, [&](SceneImpl& scene) {
        detail::require_room(hits.size(), "hits", normals.size());
        for (const Hit& hit : hits) {
            const detail::MeshPlace* const mesh = scene.meshes.find(hit.geom_id);
            if (hit && (mesh == nullptr || hit.prim_id >= mesh->prim_count)) {
                detail::throw_bad_argument("hits: there is no triangle {} of a mesh {}",
                                           hit.prim_id, hit.geom_id);
            }
        }
        const bool is_smooth = smooth && scene.meshes.is_smooth();
        if (is_smooth) {
            const std::scoped_lock lock(scene.mutex);
            detail::update_normals(scene);
        }
        detail::for_each_run(
            &scene.arena(), hits.size(), {}, [&](std::size_t first, std::size_t count) {
                for (std::size_t i = first; i < first + count; ++i) {
                    mray::vec3 normal(0, 0, 0);
                    if (const Hit& hit = hits[i]) {
                        const std::uint32_t prim =
                            scene.meshes.find(hit.geom_id)->first_prim + hit.prim_id;
                        normal = flat_normal(scene, prim);
                        const bool has_area = normal.x != 0 || normal.y != 0 || normal.z != 0;
                        if (is_smooth && has_area)
                            normal = smooth_normal_at(scene, prim, hit, normal);
                    }
                    normals[i] = {normal.x, normal.y, normal.z};
                }
            });
    });
}

}  // namespace morphray
