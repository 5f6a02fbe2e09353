// Queries about all triangles, by the shared layout.
#pragma once

#include "common/bvh/bvh.h"
#include "common/interop/closest_rule.h"
#include "common/scene_queries.h"
#include "common/simd/simd_target.h"

namespace mray::cpu {

/// Answers over a tree that outlives it; neighbours among points help. Threads may share one.
class TreeQueries {
public:
    TreeQueries(const Bvh& bvh, SimdTarget target);

    void operator()(const QueryBatch& batch) const { answer_(*bvh_, batch); }

private:
    const Bvh* bvh_;
    void (*answer_)(const Bvh&, const QueryBatch&);
};

/// Sets places[i] to closest_on_triangle() of points[i] and triangle closest[i], if there is one.
void find_places(SimdTarget target, std::span<const vec3> points,
                 std::span<const ClosestTriangle> closest, std::span<const uvec3> triangles,
                 std::span<const vec3> positions, std::span<NearPoint> places);

}  // namespace mray::cpu
