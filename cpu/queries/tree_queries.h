// Queries about all triangles, by the shared layout.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

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

/// Some triangles of a tree, in any order.
class NearTriangles {
public:
    void add(std::uint32_t prim_id) {
        if (count_ < kMost) prim_ids_[count_] = prim_id;
        ++count_;
    }
    /// False if there are too many; prim_ids() then has some of them.
    bool fit() const { return count_ <= kMost; }
    std::span<const std::uint32_t> prim_ids() const {
        return std::span(prim_ids_).first(std::min(count_, kMost));
    }

private:
    static constexpr std::size_t kMost = 12;
    std::array<std::uint32_t, kMost> prim_ids_;
    std::size_t count_ = 0;
};

/// Finds for each point, in scene space, the triangles whose squared distance by
/// triangle_distance2() is at most most_d2[i].
void find_near(const Bvh& bvh, SimdTarget target, std::span<const vec3> points,
               std::span<const float> most_d2, std::span<NearTriangles> near);

}  // namespace mray::cpu
