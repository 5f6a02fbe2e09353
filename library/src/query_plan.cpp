#include "library/src/query_plan.h"

#include <cmath>

namespace morphray::detail {

RayPart::RayPart(QueryPart part, std::span<const Ray> all)
    : QueryPart(std::move(part)), world(all) {
    rays.reserve(size());
    t_exponents.reserve(size());
    for_runs_of(0, size(), {}, [&](std::size_t first, std::size_t count) {
        std::array<Ray, kRun> given;
        for (std::size_t i = 0; i < count; ++i) given[i] = all[numbers[first + i]];
        mray::cpu::SceneRays run;
        scene.space().to_scene(std::span(given).first(count), run);
        rays.insert(rays.end(), run.rays, run.rays + count);
        for (std::size_t i = 0; i < count; ++i) t_exponents.push_back(run.t_exponents[2 * i + 1]);
    });
}

PointPart::PointPart(QueryPart part, std::span<const Vec3> all)
    : QueryPart(std::move(part)),
      world(all),
      points(size(), mray::vec3(0, 0, 0)),
      exact(size(), mray::dvec3(0, 0, 0)),
      is_finite(size()) {
    for (std::size_t i = 0; i < size(); ++i) {
        const Vec3& p = world[numbers[i]];
        is_finite[i] = std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z) ? 1 : 0;
        if (is_finite[i] != 0) scene.space().to_scene(p, exact[i], points[i]);
    }
}

}  // namespace morphray::detail
