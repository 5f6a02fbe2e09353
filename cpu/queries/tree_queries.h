// Queries about all triangles, by the shared layout.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/bvh/bvh.h"
#include "common/bvh/exact_closest.h"
#include "common/scene_queries.h"
#include "common/simd/simd_target.h"

namespace mray::cpu {

/// Answers over a tree that outlives it, with the bits of BruteTracer. Threads may share one.
/// Neighbours among the points of a call help each other.
class TreeQueries {
public:
    TreeQueries(const Bvh& bvh, SimdTarget target);

    void operator()(const QueryBatch& batch) const { answer_(*bvh_, batch); }

private:
    const Bvh* bvh_;
    void (*answer_)(const Bvh&, const QueryBatch&);
};

/// The triangles that may exactly be the closest ones of points, for one point after the other.
struct Rivals {
    std::vector<NumberedTriangle> triangles;
    /// Where those of each point end. A point that has too many gets one with kNoPrim.
    std::vector<std::uint32_t> ends;
};

/// Looks for closer triangles than `closest`, and for all rivals of those found. The watch is asked
/// before each point.
void find_rivals(const Bvh& bvh, SimdTarget target, std::span<const vec3> points,
                 std::span<ClosestTriangle> closest, Rivals& rivals, const Watch& watch = {});

}  // namespace mray::cpu
