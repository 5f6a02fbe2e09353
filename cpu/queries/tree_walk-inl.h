// A walk over all parts of a tree that a question concerns, in no order.
#if defined(MORPHRAY_CPU_QUERIES_TREE_WALK_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_QUERIES_TREE_WALK_INL_H
#undef MORPHRAY_CPU_QUERIES_TREE_WALK_INL_H
#else
#define MORPHRAY_CPU_QUERIES_TREE_WALK_INL_H
#endif

#include <bit>
#include <cassert>
#include <cstddef>
#include <cstdint>

#include "common/bvh/bvh.h"
#include "cpu/single_ray/node_lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {
using namespace simd::HWY_NAMESPACE;

/// Calls visit(leaf) for the leaves below node `root` whose box, and those of the nodes above, are
/// among met(node), which returns slots as bits, until it returns false. Returns whether it never
/// did.
template <class Met, class Visit>
HWY_INLINE bool for_each_leaf(const Bvh& bvh, Met met, Visit visit, std::uint32_t root = 0) {
    std::uint32_t stack[kMaxStack];
    stack[0] = root;
    for (std::size_t size = 1; size > 0;) {
        const Node& node = bvh.nodes[stack[--size]];
        const std::uint32_t slots = met(node);
        const std::uint32_t leaves = leaf_slots(node);
        for (std::uint32_t rest = slots & leaves; rest != 0; rest &= rest - 1) {
            if (!visit(bvh.leaves[node.child[std::countr_zero(rest)] & ~kLeafBit])) return false;
        }
        for (std::uint32_t rest = slots & ~leaves; rest != 0; rest &= rest - 1) {
            assert(size < kMaxStack);
            stack[size++] = node.child[std::countr_zero(rest)];
        }
    }
    return true;
}

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif  // per target
