// The walks of rays down the tree: one ray or up to 64 together, front to back or in any order.
//
// Rays of one octant go down together with a mask of rays for each entry of the stack: a node's
// boxes are tested first for all rays at once and then for each ray
// (cpu/single_ray/node_lanes-inl.h). Front to back, an entry has a bound of the least depth of hits
// in its box. Rays whose last_depth is before it leave the mask when the entry is taken: a hit in
// the box would not be closer, nor as close.
#if defined(MORPHRAY_CPU_SINGLE_RAY_WALKS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_SINGLE_RAY_WALKS_INL_H
#undef MORPHRAY_CPU_SINGLE_RAY_WALKS_INL_H
#else
#define MORPHRAY_CPU_SINGLE_RAY_WALKS_INL_H
#endif

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "common/bvh/bvh.h"
#include "cpu/single_ray/closest_leaf-inl.h"
#include "cpu/single_ray/leaf_hit_rule-inl.h"
#include "cpu/single_ray/node_lanes-inl.h"
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

// A ray by itself would wait for the boxes of a node before it can load the next node. Branches
// choose the slot of the next child instead: the processor predicts them and loads the child early.

/// Keeps compilers from replacing the branches that set a value by arithmetic.
HWY_INLINE void keep_branch(std::uint32_t& value) { asm volatile("" : "+r"(value)); }

/// Calls visit(slot) for the first of these slots, one or more, by a branch for each slot.
template <class Visit, std::uint32_t... slot>
HWY_INLINE void visit_guessed_slot(std::uint32_t slots, Visit visit,
                                   std::integer_sequence<std::uint32_t, slot...>) {
    static_cast<void>((((slots & (1u << slot)) != 0 && (visit(slot), true)) || ...));
}
template <class Visit>
HWY_INLINE void visit_guessed_slot(std::uint32_t slots, Visit visit) {
    visit_guessed_slot(slots, visit, std::make_integer_sequence<std::uint32_t, kWidth>());
}

/// Calls visit(leaf) for the leaves below node `root` whose box, and those of the nodes above, are
/// among met(node), which returns slots as bits, until it returns false. Returns whether it never
/// did. The leaves of a node come before its other children, in no other order.
template <class Met, class Visit>
HWY_INLINE bool for_each_leaf(const Bvh& bvh, Met met, Visit visit, std::uint32_t root = 0) {
    std::uint32_t stack[kMaxStack];
    std::size_t size = 0;
    for (std::uint32_t index = root;;) {
        const Node& node = bvh.nodes[index];
        const std::uint32_t slots = met(node);
        const std::uint32_t leaves = leaf_slots(node);
        for (std::uint32_t rest = slots & leaves; rest != 0; rest &= rest - 1) {
            if (!visit(bvh.leaves[node.child[std::countr_zero(rest)] & ~kLeafBit])) return false;
        }
        std::uint32_t rest = slots & ~leaves;
        if (rest == 0) {
            if (size == 0) return true;
            index = stack[--size];
            continue;
        }
        visit_guessed_slot(rest, [&](std::uint32_t slot) HWY_ATTR {
            index = node.child[slot];
            keep_branch(index);
        });
        for (rest &= rest - 1; rest != 0; rest &= rest - 1) {
            assert(size < kMaxStack);
            stack[size++] = node.child[std::countr_zero(rest)];
        }
    }
}

/// Sets `nearest` to the nearest of the children in these slots, one or more, and pushes the others
/// so that the nearest of them is on top; returns the new size.
HWY_INLINE std::size_t push_others(const Node& node, std::uint32_t slots, const float* bounds,
                                   StackEntry* stack, std::size_t size, StackEntry& nearest) {
    visit_guessed_slot(slots, [&](std::uint32_t slot) HWY_ATTR {
        nearest = {bounds[slot], node.child[slot]};
        keep_branch(nearest.child);
    });
    const std::size_t base = size;
    for (slots &= slots - 1; slots != 0; slots &= slots - 1) {
        const auto slot = static_cast<std::uint32_t>(std::countr_zero(slots));
        StackEntry other = {bounds[slot], node.child[slot]};
        if (other.t_least < nearest.t_least) {
            std::swap(other, nearest);
            keep_branch(nearest.child);
        }
        insert_sorted(stack, base, size++, other);
    }
    return size;
}

/// Calls visit_leaf(index) for the leaves whose bound is `most` or less, the nearest box first.
/// near(node, bounds) returns the slots of the boxes that are, as bits, and sets their bounds.
/// Visits may make `most` less.
template <class Near, class VisitLeaf>
HWY_INLINE void for_each_near_leaf(const Bvh& bvh, const float& most, Near near,
                                   VisitLeaf visit_leaf) {
    StackEntry stack[kMaxStack];
    std::size_t size = 0;
    StackEntry entry = {0, 0};
    for (;;) {
        if ((entry.child & kLeafBit) != 0) {
            visit_leaf(entry.child & ~kLeafBit);
        } else {
            const Node& node = bvh.nodes[entry.child];
            HWY_ALIGN float bounds[kWidth];
            if (const std::uint32_t slots = near(node, bounds); slots != 0) {
                size = push_others(node, slots, bounds, stack, size, entry);
                continue;
            }
        }
        do {
            if (size == 0) return;
            entry = stack[--size];
        } while (entry.t_least > most);
    }
}

/// The same for the leaves that a ray whose main axis is kAxis meets, with their least depths.
template <int kAxis, class VisitLeaf>
HWY_INLINE void for_each_near_leaf(const Bvh& bvh, const RayStream& stream, std::size_t ray,
                                   const float& depth, VisitLeaf visit_leaf) {
    const auto near = [&](const Node& node, float* HWY_RESTRICT t_least) HWY_ATTR {
        FloatVec least[kVectors];
        const std::uint32_t met = near_slots<kAxis>(stream, ray, depth, node, least);
        for (std::size_t v = 0; v < kVectors; ++v) store(least[v], t_least + v * kLanes);
        return met;
    };
    for_each_near_leaf(bvh, depth, near,
                       [&](std::uint32_t leaf) HWY_ATTR { visit_leaf(bvh.leaves[leaf]); });
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
    float farthest = largest_of(last, count);
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
        if constexpr (Walk::kFrontToBack) farthest = largest_of(last, count);
        FloatVec least[kVectors];
        HWY_ALIGN float t_least[kWidth];
        std::uint32_t slots = near_slots(bundle, farthest, node, least);
        if (slots == 0) continue;
        for (std::size_t v = 0; v < kVectors; ++v) store(least[v], t_least + v * kLanes);
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

// One ray by itself: prepared without vectors, because a vector of one ray takes as long as a full
// one, and traced one node after the other.

/// a * b + c as mul_add() rounds it.
HWY_INLINE float mul_add_one(float a, float b, float c) {
#if HWY_NATIVE_FMA
    return __builtin_fmaf(a, b, c);
#else
    return a * b + c;
#endif
}

/// prepare_slab() for ray 0 of a stream.
HWY_INLINE void prepare_slab_of_one(RayStream& stream, std::uint32_t axis, float org, float dir,
                                    float least) {
    const float rdir = dir == 0 ? kHugeReciprocal : 1.0f / dir;
    const float rdir_far = rdir * kStreamRounding;
    const float dilation = (kStreamDilation * std::abs(org) + least) * std::abs(rdir);
    stream.rdir[axis][0] = rdir;
    stream.rdir_far[axis][0] = rdir_far;
    stream.k_near[axis][0] = mul_add_one(org, rdir, dilation);
    stream.k_far[axis][0] = mul_add_one(org, rdir_far, -dilation);
    stream.near_offset[axis][0] = 2 * kPlaneBytes * axis + (rdir < 0 ? kPlaneBytes : 0);
}

/// Sets what closest hits ask of ray 0 of a stream that is alone in it, with the bits of
/// prepare_rays(). Only vectors of rays ask for org, dir and the slopes.
HWY_INLINE void prepare_one(RayStream& stream, const Ray& ray) {
    const float least = mray::least_dilation(ray.org);
    for (std::uint32_t axis = 0; axis < 3; ++axis)
        prepare_slab_of_one(stream, axis, ray.org[axis], ray.dir[axis], least);
    stream.tnear[0] = ray.tnear;
    stream.tfar[0] = ray.tfar;
    stream.least_dilation[0] = least;
    stream.depth_margin[0] = mray::depth_margin(ray.org);
    stream.last_depth[0] = mray::last_depth(ray.tfar);
    // As shear_ray(), but by components: compilers copy its vectors through memory, which took a
    // tenth of a call (lab/notes/cpu_tracer.md).
    const std::uint32_t axis = largest_axis(ray.dir);
    const std::uint32_t axes[3] = {axis == 2 ? 0 : axis + 1, axis == 0 ? 2 : axis - 1, axis};
    for (int k = 0; k < 3; ++k) {
        stream.sheared_org[k][0] = ray.org[axes[k]];
        stream.sheared_dir[k][0] = ray.dir[axes[k]];
    }
    stream.axis[0] = axis;
    stream.depth_slack[0] = 0.25f * stream.depth_margin[0];
    const DepthlessBound<float> bound =
        depthless_bound(most_depth(std::abs(stream.sheared_org[2][0])));
    stream.bound_linear[0] = bound.linear;
    stream.bound_constant[0] = bound.constant;
}

/// prepare_range() for such a ray.
HWY_INLINE void prepare_range_of_one(RayStream& stream, const Ray& ray) {
    const float size = mray::extent_of_rays(ray.org);
    const float margin = kCertainDepth * size;
    const float dz = std::abs(stream.sheared_dir[2][0]);
    stream.certain_from[0] = ray.tnear * dz + margin;
    const float end = std::min(ray.tfar * dz, 4.0f * size);
    const bool is_near = size <= kCertainOrigin;
    stream.certain_to[0] = is_near ? end - margin : -1.0f;
    stream.certain_beyond[0] = is_near ? end + kBeyondDepth * size : kHugeReciprocal;
}

/// The closest hit of a ray whose main axis is kAxis.
template <int kAxis>
HWY_NOINLINE void intersect_ray_along(const Bvh& bvh, const RayStream& stream, std::size_t ray,
                                      ClosestHits& closest) {
    for_each_near_leaf<kAxis>(bvh, stream, ray, closest.last[ray], [&](const Leaf& leaf) HWY_ATTR {
        intersect_leaf_alone<kAxis>(stream, ray, leaf, closest);
    });
}

/// The closest hit of a ray.
HWY_INLINE void intersect_ray(const Bvh& bvh, const RayStream& stream, std::size_t ray,
                              ClosestHits& closest) {
    const std::uint32_t axis = stream.axis[ray];
    if (axis == 0) return intersect_ray_along<0>(bvh, stream, ray, closest);
    if (axis == 1) return intersect_ray_along<1>(bvh, stream, ray, closest);
    intersect_ray_along<2>(bvh, stream, ray, closest);
}

/// The closest hit of a ray by itself.
HWY_NOINLINE inline Hit intersect_one(const Bvh& bvh, const Ray& ray) {
    RayStream stream;
    prepare_one(stream, ray);
    ClosestHits closest;
    closest.t[0] = ray.tfar;
    closest.last[0] = stream.last_depth[0];
    closest.u[0] = closest.v[0] = 0;
    closest.prim_id[0] = kNoPrim;
    intersect_ray(bvh, stream, 0, closest);
    return closest.hit(0);
}

/// Whether a ray by itself whose main axis is kAxis hits anything.
template <int kAxis>
HWY_NOINLINE bool occluded_along(const Bvh& bvh, const RayStream& stream) {
    const auto met = [&](const Node& node) HWY_ATTR { return met_slots(stream, 0, node); };
    return !for_each_leaf(bvh, met, [&](const Leaf& leaf) HWY_ATTR {
        return !occluded_by_leaf<kAxis>(stream, 0, leaf);
    });
}

/// Whether it hits anything.
HWY_NOINLINE inline bool occluded_one(const Bvh& bvh, const Ray& ray) {
    RayStream stream;
    prepare_one(stream, ray);
    prepare_range_of_one(stream, ray);
    if (stream.axis[0] == 0) return occluded_along<0>(bvh, stream);
    if (stream.axis[0] == 1) return occluded_along<1>(bvh, stream);
    return occluded_along<2>(bvh, stream);
}

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif  // per target
