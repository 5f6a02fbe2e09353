// The walks of rays down the tree: one ray or up to 64 together, front to back or in any order.
//
// Rays of one octant go down together with a mask of rays for each entry of the stack: a node's
// boxes are tested first for all rays at once and then for each ray
// (cpu/single_ray/ray_bundle-inl.h). Front to back, an entry has a bound of the least depth of hits
// in its box. Rays whose last_depth is before it leave the mask when the entry is taken: a hit in
// the box would not be closer, nor as close.
#if defined(MORPHRAY_CPU_SINGLE_RAY_WALKS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_SINGLE_RAY_WALKS_INL_H
#undef MORPHRAY_CPU_SINGLE_RAY_WALKS_INL_H
#else
#define MORPHRAY_CPU_SINGLE_RAY_WALKS_INL_H
#endif

#include <bit>
#include <cassert>
#include <cstddef>
#include <cstdint>

#include "common/bvh/bvh.h"
#include "cpu/single_ray/node_lanes-inl.h"
#include "cpu/single_ray/ray_bundle-inl.h"
#include "cpu/single_ray/ray_stream-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {
using namespace simd::HWY_NAMESPACE;

/// Inserts an entry into those of [base, size), which are sorted by t_least, the nearest last.
template <class Entry>
HWY_INLINE void insert_sorted(Entry* stack, std::size_t base, std::size_t size,
                              const Entry& entry) {
    assert(size < kMaxStack);
    for (; size > base && stack[size - 1].t_least < entry.t_least; --size)
        stack[size] = stack[size - 1];
    stack[size] = entry;
}

struct StackEntry {
    float t_least;
    std::uint32_t child;
};

/// Pushes the children in these slots so that the nearest is on top; returns the new size.
HWY_INLINE std::size_t push_sorted(const Node& node, std::uint32_t slots, const float* t_least,
                                   StackEntry* stack, std::size_t size) {
    const std::size_t base = size;
    for (; slots != 0; slots &= slots - 1) {
        const auto slot = static_cast<std::uint32_t>(std::countr_zero(slots));
        insert_sorted(stack, base, size++, StackEntry{t_least[slot], node.child[slot]});
    }
    return size;
}

/// Calls visit(leaf) for the leaves below node `root` whose box, and those of the nodes above, are
/// among met(node), which returns slots as bits, until it returns false. Returns whether it never
/// did. The leaves of a node come before its other children, in no other order.
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

/// Calls visit_leaf(leaf) for the leaves that a ray whose main axis is kAxis meets with a least
/// depth of `depth` or less, one node after the other, its nearest box first. Visits may make
/// `depth` less. Where a node has one or two children to visit, the ray goes straight on; one is
/// both the first and the last, so that no branch tells it from two.
template <int kAxis, class VisitLeaf>
HWY_INLINE void for_each_near_leaf(const Bvh& bvh, const RayStream& stream, std::size_t ray,
                                   const float& depth, VisitLeaf visit_leaf) {
    StackEntry stack[kMaxStack];
    std::size_t size = 0;
    StackEntry entry = {0, 0};
    for (;;) {
        if ((entry.child & kLeafBit) != 0) {
            visit_leaf(bvh.leaves[entry.child & ~kLeafBit]);
        } else {
            const Node& node = bvh.nodes[entry.child];
            FloatVec least[kVectors];
            const std::uint32_t met = near_slots<kAxis>(stream, ray, depth, node, least);
            if (met != 0) {
                HWY_ALIGN float t_least[kWidth];
                for (std::size_t v = 0; v < kVectors; ++v) store(least[v], t_least + v * kLanes);
                const std::uint32_t rest = met & (met - 1);
                if ((rest & (rest - 1)) == 0) {
                    const auto first_slot = static_cast<std::uint32_t>(std::countr_zero(met));
                    const auto last_slot = static_cast<std::uint32_t>(std::bit_width(met)) - 1;
                    const StackEntry first = {t_least[first_slot], node.child[first_slot]};
                    const StackEntry last = {t_least[last_slot], node.child[last_slot]};
                    const bool is_nearer = last.t_least < first.t_least;
                    assert(size < kMaxStack);
                    stack[size] = is_nearer ? first : last;
                    size += rest != 0;
                    entry = is_nearer ? last : first;
                    continue;
                }
                size = push_sorted(node, met, t_least, stack, size);
                entry = stack[--size];
                continue;
            }
        }
        do {
            if (size == 0) return;
            entry = stack[--size];
        } while (entry.t_least > depth);
    }
}

/// Takes the first `count` rays of a stream, of one octant, down the tree together. `walk` has
///   kFrontToBack              whether the nearest child comes first, or children in any order
///   last_depths()             the depth up to which each ray looks for hits; any order: last_depth
///   rays_left(rays, t_least)  those among the rays that look for hits from t_least on
///   stay_together(rays)       whether rays go on together below a node
///   part(rays, child)         takes over those that do not, below this child
///   visit_leaf(rays, leaf)
template <class Walk>
HWY_INLINE void walk_together(const Bvh& bvh, const RayStream& stream, std::size_t count,
                              Walk& walk) {
    struct Entry {
        std::uint64_t rays;
        std::uint32_t child;
        float t_least;
    };
    const RayBundle bundle = bundle_of(stream, count);
    const float* const last = walk.last_depths();
    const float end = last_entry(bundle.depth_margin, largest_of(stream.last_depth, count));
    Entry stack[kMaxStack];
    stack[0] = {~std::uint64_t{0} >> (kStreamRays - count), 0, 0};
    for (std::size_t size = 1; size > 0;) {
        const Entry entry = stack[--size];
        const std::uint64_t rays = walk.rays_left(entry.rays, entry.t_least);
        if (rays == 0) continue;
        if ((entry.child & kLeafBit) != 0) {
            walk.visit_leaf(rays, bvh.leaves[entry.child & ~kLeafBit]);
            continue;
        }
        if (!walk.stay_together(rays)) {
            walk.part(rays, entry.child);
            continue;
        }
        const Node& node = bvh.nodes[entry.child];
        std::uint32_t slots;
        HWY_ALIGN float t_least[kWidth];
        if constexpr (Walk::kFrontToBack) {
            FloatVec least[kVectors];
            slots = near_slots(bundle, largest_of(last, kStreamRays), node, least);
            for (std::size_t v = 0; v < kVectors; ++v) store(least[v], t_least + v * kLanes);
        } else {
            slots = met_slots(bundle, end, node);
        }
        if (slots == 0) continue;
        std::uint64_t met[kWidth];
        rays_meeting(stream, bundle, last, rays, node, slots, met);
        const std::size_t base = size;
        for (; slots != 0; slots &= slots - 1) {
            const int slot = std::countr_zero(slots);
            if constexpr (Walk::kFrontToBack) {
                if (met[slot] == 0) continue;
                insert_sorted(stack, base, size++,
                              Entry{met[slot], node.child[slot], t_least[slot]});
            } else {
                assert(size < kMaxStack);
                stack[size] = {met[slot], node.child[slot], 0};
                size += met[slot] != 0;
            }
        }
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif  // per target
