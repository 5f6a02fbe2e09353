// The normals of hits.
#include <cmath>

#include <glm/geometric.hpp>

#include "common/interop/shading.h"
#include "library/src/query_plan.h"

namespace morphray {
using namespace detail;

mray::vec3 detail::flat_normal(const SceneImpl& scene, std::uint32_t prim) {
    const mray::uvec3 corners = scene.meshes().topology().triangles[prim];
    const auto at = [&](std::uint32_t corner) {
        return glm::dvec3(scene.pose().positions()[corner]);
    };
    const glm::dvec3 normal =
        glm::cross(at(corners.y) - at(corners.x), at(corners.z) - at(corners.x));
    const double length = glm::length(normal);
    if (!(length > 0) || !std::isfinite(length)) return {0, 0, 0};
    return mray::vec3(normal / length);
}

std::array<mray::vec3, 3> detail::corner_normals(const mray::VertexNormals& smooth,
                                                 std::uint32_t prim, mray::vec3 flat) {
    const mray::uvec3 ids = smooth.ids()[prim];
    const auto at = [&](std::uint32_t id) {
        return id == mray::kFlatCorner ? flat : mray::corner_normal(smooth.normals()[id], flat);
    };
    return {at(ids.x), at(ids.y), at(ids.z)};
}

void Scene::normals(std::span<const Hit> hits, std::span<Vec3> normals, bool smooth) const {
    with_scene(impl_, [&](SceneImpl& scene) {
        require_room(hits.size(), "hits", normals.size());
        const MeshList& meshes = scene.meshes();
        for (const Hit& hit : hits) {
            const MeshSlot* const mesh = meshes.find(hit.geom_id);
            if (hit && (mesh == nullptr || hit.prim_id >= mesh->prim_count))
                throw_bad_argument("hits: there is no triangle {} of a mesh {}", hit.prim_id,
                                   hit.geom_id);
        }
        const mray::VertexNormals* smooth_normals = nullptr;
        if (smooth && meshes.is_smooth()) {
            const std::scoped_lock lock(scene.mutex());
            smooth_normals = &scene.normals();
        }
        for_each_run(&scene.arena(), hits.size(), {}, [&](std::size_t first, std::size_t count) {
            for (std::size_t i = first; i < first + count; ++i) {
                mray::vec3 normal(0, 0, 0);
                if (const Hit& hit = hits[i]) {
                    const std::uint32_t prim = meshes.find(hit.geom_id)->first_prim + hit.prim_id;
                    normal = flat_normal(scene, prim);
                    const bool has_area = normal.x != 0 || normal.y != 0 || normal.z != 0;
                    if (smooth_normals != nullptr && has_area) {
                        const auto [a, b, c] = corner_normals(*smooth_normals, prim, normal);
                        normal = mray::smooth_normal(a, b, c, hit.u, hit.v);
                    }
                }
                normals[i] = {normal.x, normal.y, normal.z};
            }
        });
    });
}

}  // namespace morphray
