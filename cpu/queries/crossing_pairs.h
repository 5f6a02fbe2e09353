// The pairs of triangles of a tree that cross (common/scene/triangle_crossing.h).
#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/bvh/bvh.h"
#include "common/simd/simd_target.h"

namespace mray::cpu {

/// Two triangles, the one of the lower prim_id first.
struct TrianglePair {
    std::uint32_t first, second;

    auto operator<=>(const TrianglePair&) const = default;
};

/// Bits of a triangle: the sets that it belongs to. A pair has one of each set.
inline constexpr std::uint8_t kInFirstSet = 1;
inline constexpr std::uint8_t kInSecondSet = 2;

/// A tree over triangles of two sets, and their vertices in a space of which scene space is an
/// image: scaled and moved, and rounded by at most 2^-41. Its arrays must outlive it.
struct CrossingScene {
    const Bvh& bvh;
    const Topology& topology;
    std::span<const vec3> positions;
    /// For each triangle its sets. Empty: all are in both.
    std::span<const std::uint8_t> sets = {};
};

/// Appends the pairs that cross, of which one is in leaf `leaf` and the other in it or in a later
/// one, in any order; none of Bvh::repeated. Triangles with a vertex that is left out have none.
/// Threads may ask about different leaves at the same time.
using FindCrossings = void (*)(const CrossingScene& scene, std::uint32_t leaf,
                               std::vector<TrianglePair>& found);
FindCrossings find_crossings(const SimdTarget& target);

}  // namespace mray::cpu
