// The parts of a degraded tree that restructuring puts under new levels.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/base/aligned_vector.h"
#include "common/bvh/builder/binary_tree.h"
#include "common/bvh/bvh.h"
#include "common/update/restructure.h"

namespace mray {

inline bool is_leaf(std::uint32_t child) { return (child & kLeafBit) != 0; }
inline std::uint32_t leaf_of(std::uint32_t child) { return child & ~kLeafBit; }

/// Calls use(slot, child) for each child entry of a node.
template <class Use>
void for_each_child(const Node& node, Use use) {
    for (std::uint32_t slot = 0; slot < kWidth && node.child[slot] != kEmptyChild; ++slot)
        use(slot, node.child[slot]);
}

/// The parts under the new levels.
struct RestructureParts {
    /// The child entries, in the old tree, of subtrees that stay as they are.
    std::vector<std::uint32_t> subtrees;
    std::vector<std::uint32_t> degraded_leaves;
    /// References to the triangles of degraded leaves, ascending, then to the subtrees.
    AlignedVector<PrimRef> refs;
};

/// Finds them for restructure(), which says what its arguments mean. Empty if all is sound, or if a
/// build would not cost much more.
RestructureParts find_restructure_parts(const Topology& topology, std::span<const vec3> positions,
                                        double growth, double most, const Bvh& bvh,
                                        const BuiltAreas& areas);

}  // namespace mray
