// Queries about all triangles, by the shared layout.
#pragma once

#include "common/bvh/bvh.h"
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

}  // namespace mray::cpu
