// The way of a packet through the tree, nearest boxes first.
//
// Based on: I. Wald, S. Boulos, P. Shirley. Ray Tracing Deformable Scenes Using Dynamic Bounding
// Volume Hierarchies. ACM TOG 26(1), 2007: packets far larger than a vector, one conservative test
// of the whole packet per node, ordered descent. Changed: sixteen children are tested at once in
// the packet's own projection; the active part of the packet is a mask of blocks, culled by depth
// block by block; and triangles are set up sixteen at a time as homogeneous edge functions (M.
// Olano, T. Greer. Triangle scan conversion using 2D homogeneous coordinates. 1997), so that no
// vertex beside or behind the eye needs clipping.
//
// The bounds here never contradict the hit rule (common/interop/hit_rule.h): edge functions and 1/z
// carry a bound of their distance from what the rule computes, they decide only beyond that bound,
// and the rule resolves the rest. So any arithmetic may be used, fused or not.

#if defined(MORPHRAY_CPU_PACKET_PACKET_TRAVERSAL_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_PACKET_PACKET_TRAVERSAL_INL_H
#undef MORPHRAY_CPU_PACKET_PACKET_TRAVERSAL_INL_H
#else
#define MORPHRAY_CPU_PACKET_PACKET_TRAVERSAL_INL_H
#endif

#include <hwy/highway.h>

#include <cassert>
#include <cstddef>
#include <cstdint>

#include "common/bvh/bvh.h"
#include "cpu/packet/packet_node-inl.h"
#include "cpu/simd/hit_rule-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {

/// Prefetches a child's memory without a branch: a leaf's first lines are prefetched twice.
HWY_INLINE void prefetch_child(const Bvh& bvh, std::uint32_t child) {
    static_assert(sizeof(Leaf) <= sizeof(Node));
    const bool is_leaf = (child & kLeafBit) != 0;
    const char* const bytes = is_leaf
                                  ? reinterpret_cast<const char*>(&bvh.leaves[child & ~kLeafBit])
                                  : reinterpret_cast<const char*>(&bvh.nodes[child]);
    prefetch(bytes, sizeof(Leaf));
    prefetch(bytes + (is_leaf ? 0 : sizeof(Leaf)), sizeof(Node) - sizeof(Leaf));
}

/// Walks a packet through the tree. `Walk` knows the packet:
///
///     Part              what of the packet a box may concern
///     frame()           the packet's frame
///     narrow(q, is_node, part)
///                       drops from a part what no hit with 1/z <= q concerns. Returns whether any
///                       is left
///     find_parts(children, slots, part, parts)
///                       sets parts[slot] to what of `part` children concern, for those of `slots`.
///                       Returns the slots that concern any
///     visit_leaf(leaf, q, part)
///                       tests a leaf, whose box is no nearer than q (nearest_q). Returns false to
///                       end here
template <class Walk>
class alignas(kPage) PacketTraversal {
public:
    using Part = typename Walk::Part;

    PacketTraversal(const Bvh& bvh, Walk& walk) : bvh_(bvh), walk_(walk) {}

    /// Visits the root, which concerns `whole`. Returns whether it has children that the packet may
    /// hit.
    bool start(const Part& whole) {
        visit_node(bvh_.nodes[0], whole);
        return size_ > 0;
    }

    /// Visits what start() found. Returns false if the walk ended before.
    bool run() {
        while (size_ > 0) {
            const Entry& top = stack_[--size_];
            const float q = top.q;
            const std::uint32_t child = top.child;
            Part part = top.part;
            const bool is_node = (child & kLeafBit) == 0;
            if (!walk_.narrow(q, is_node, part)) continue;
            if (is_node) {
                visit_node(bvh_.nodes[child], part);
            } else if (!walk_.visit_leaf(bvh_.leaves[child & ~kLeafBit], q, part)) {
                return false;
            }
        }
        return true;
    }

private:
    /// A child to visit: its box is seen no nearer than q (nearest_q).
    struct Entry {
        Part part;
        float q;
        std::uint32_t child;
    };

    void visit_node(const Node& node, const Part& part) {
        NodeChildren children;
        const std::uint32_t hits = project_node(walk_.frame(), node, children);
        Part parts[kWidth];
        const std::uint32_t kept = walk_.find_parts(children, hits, part, parts);
        alignas(64) std::int32_t order[kWidth];
        order_of(children.q, order);
        for (std::uint32_t rest = kept; rest != 0; rest &= rest - 1) {
            const auto slot = static_cast<std::uint32_t>(__builtin_ctz(rest));
            assert(node.child[slot] != kEmptyChild);
            stack_[size_ + hwy::PopCount(kept & slots_before(order, order[slot]))] = {
                parts[slot], children.q[slot], node.child[slot]};
            prefetch_child(bvh_, node.child[slot]);
        }
        size_ += static_cast<std::uint32_t>(hwy::PopCount(kept));
    }

    /// Sets distinct numbers in the order of 1/z except for its last 4 bits: the bits of floats
    /// that are not negative, with the slot in the last bits.
    static HWY_INLINE void order_of(const float* q, std::int32_t* order) {
        for (std::size_t l = 0; l < kWidth; l += kLanes) {
            const auto bits = as_int(load(q + l));
            const auto slots = hn::Iota(kInts, static_cast<std::int32_t>(l));
            store((bits & splat(~15)) | slots, order + l);
        }
    }

    /// The children whose order is less than `own`: those farther away.
    static HWY_INLINE std::uint32_t slots_before(const std::int32_t* order, std::int32_t own) {
        std::uint32_t before = 0;
        for (std::size_t l = 0; l < kWidth; l += kLanes) {
            const auto is_before = load(order + l) < splat(own);
            before |= bits_of(float_mask(is_before)) << l;
        }
        return before;
    }

    const Bvh& bvh_;
    Walk& walk_;
    std::uint32_t size_ = 0;
    Entry stack_[kMaxStack];
};

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif
