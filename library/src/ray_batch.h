// Batches of rays in scene space, and the triangles that they see.
#pragma once

#include <fmt/format.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/interop/ray.h"
#include "cpu/scene_space/to_scene.h"
#include "library/src/ray_order.h"
#include "library/src/ray_space.h"
#include "library/src/scene/errors.h"
#include "library/src/scene/mesh_list.h"
#include "morphray/queries.hpp"

namespace morphray::detail {

/// Rays in scene space, and what their t is multiplied by.
struct SceneBatch {
    std::vector<mray::Ray> rays;
    std::vector<int> t_exponents;

    SceneBatch(const RaySpace& space, std::span<const Ray> world) {
        rays.reserve(world.size());
        t_exponents.reserve(world.size());
        for_runs_of(0, world.size(), {}, [&](std::size_t first, std::size_t count) {
            mray::cpu::SceneRays run;
            space.to_scene(world.subspan(first, count), run);
            rays.insert(rays.end(), run.rays, run.rays + count);
            for (std::size_t i = 0; i < count; ++i)
                t_exponents.push_back(run.t_exponents[2 * i + 1]);
        });
    }
};

/// The triangles that the rays of a batch see, by QueryOptions. The options must outlive it.
class RayFilter {
public:
    /// Throws Error for a wrong number of flags or of excluded triangles.
    RayFilter(const MeshList& meshes, std::size_t rays, const QueryOptions& options)
        : meshes_(meshes), options_(options) {
        if (options.excluded && options.excluded->size() != rays)
            throw_bad_argument("excluded: {} for {} rays", options.excluded->size(), rays);
        if (!options.visible) return;
        // The highest geom_ids may be free since a detach(), and may have flags.
        const std::size_t flags = options.visible->size();
        std::size_t least = meshes.places().size();
        while (least > 0 && !meshes.places()[least - 1].used) --least;
        if (flags < least || flags > meshes.places().size())
            throw_bad_argument("visible: {} flags, but {} geom_ids", flags, least);
    }

    mray::Watch watch() const { return mray::Watch(options_.cancel); }
    bool sees_all() const { return !options_.visible && !options_.excluded; }
    bool sees(std::size_t ray, std::uint32_t prim_id) const {
        return sees(ray, meshes_.locate(0, 0, 0, prim_id));
    }
    bool sees(std::size_t ray, const Hit& hit) const {
        if (options_.visible && (*options_.visible)[hit.geom_id] == 0) return false;
        return !options_.excluded || hit.primitive() != (*options_.excluded)[ray];
    }

private:
    const MeshList& meshes_;
    const QueryOptions& options_;
};

}  // namespace morphray::detail
