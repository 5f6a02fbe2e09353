// A triangle as the builder sees it.
#pragma once

#include <bit>
#include <cstdint>
#include <span>

#include "common/bvh/box.h"
#include "common/scene/mesh.h"
#include "common/simd/simd_target.h"

namespace mray {

/// The box and the id of a triangle (or of a part of a tree, see build_binary_tree), as eight
/// floats: lower x y z, id, -upper x y z, 0. The union of two boxes is then one minimum. The bits
/// of the id are those of a float in [2, 2^33), so that no arithmetic on whole registers meets a
/// denormal or a NaN.
struct alignas(32) PrimRef {
    float planes[8];

    static constexpr std::uint32_t kIdBits = 0x40000000;

    PrimRef() = default;
    PrimRef(const Box& box, std::uint32_t prim_id)
        : planes{box.lower.x,  box.lower.y,  box.lower.z,  std::bit_cast<float>(kIdBits | prim_id),
                 -box.upper.x, -box.upper.y, -box.upper.z, 0} {}

    std::uint32_t prim_id() const { return std::bit_cast<std::uint32_t>(planes[3]) ^ kIdBits; }
    Box box() const {
        return {{planes[0], planes[1], planes[2]}, {-planes[4], -planes[5], -planes[6]}};
    }
    /// Whether the box is Box(). Compares bits, in one instruction.
    bool empty() const {
        return std::bit_cast<std::uint32_t>(planes[0]) == std::bit_cast<std::uint32_t>(kEmptyPlane);
    }
    /// Twice the centroid of the box, rounded once; 0 for an empty one.
    float centroid2(int axis) const { return planes[axis] - planes[4 + axis]; }
};

/// The ref of a triangle, whose box leaves out vertices that are not finite.
PrimRef make_ref(const Topology& topology, std::span<const vec3> positions, std::uint32_t prim_id);

/// make_ref for the triangles first .. first + refs.size() - 1, many times as fast. positions has
/// one entry for each vertex of the topology.
void make_refs(const Topology& topology, std::span<const vec3> positions, std::uint32_t first,
               std::span<PrimRef> refs, const SimdTarget& target = best_simd_target());

/// The union of the boxes of the refs; empty for none.
Box union_of(std::span<const PrimRef> refs, const SimdTarget& target = best_simd_target());

/// The bounds of twice the centroids of those refs that are not empty; empty for none.
Box centroid_bounds(std::span<const PrimRef> refs, const SimdTarget& target = best_simd_target());

}  // namespace mray
