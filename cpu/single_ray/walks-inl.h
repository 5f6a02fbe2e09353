// The traversals of single rays: one ray by itself; rays that have left a stream, many of them in
// turn; and closest and any hits of a stream of up to 64 rays of one octant.
#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <span>
#include <utility>

#include "cpu/single_ray/leaf-inl.h"
#include "cpu/single_ray/node_lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu::HWY_NAMESPACE {

// ---- The tree

/// Inserts an entry into [base, size), which is sorted by t_least, the nearest last.
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

/// Calls visit(leaf) for the leaves below node `root` whose box, and the boxes of the nodes above,
/// are among met(node), which returns slots as bits, until it returns false. Returns whether it
/// never did. The leaves of a node come before its other children, in no other order.
template <class Met, class Visit>
HWY_INLINE bool for_each_leaf(const Bvh& bvh, Met met, Visit visit, std::uint32_t root = 0) {
    TraversalStack<std::uint32_t> stack;
    std::size_t size = 0;
    for (std::uint32_t index = root;;) {
        const Node& node = bvh.nodes[index];
        const std::uint32_t slots = met(node);
        const std::uint32_t leaves = leaf_slots(node);
        for (const std::uint32_t slot : BitsOf(slots & leaves))
            if (!visit(bvh.leaves[leaf_of(child_of(node, slot))])) return false;
        const std::uint32_t rest = slots & ~leaves;
        if (rest == 0) {
            if (size == 0) return true;
            index = stack[--size];
            continue;
        }
        visit_guessed_slot(rest, [&](std::uint32_t slot) HWY_ATTR {
            index = child_of(node, slot);
            keep_branch(index);
        });
        for (const std::uint32_t slot : BitsOf(rest & (rest - 1))) {
            assert(size < kMaxStack);
            stack[size++] = child_of(node, slot);
        }
    }
}

/// Sets `nearest` to the nearest of the children in these slots, one or more, and pushes the others
/// so that the nearest of them is on top; returns the new size.
HWY_INLINE std::size_t push_others(const Node& node, std::uint32_t slots, const float* bounds,
                                   StackEntry* stack, std::size_t size, StackEntry& nearest) {
    visit_guessed_slot(slots, [&](std::uint32_t slot) HWY_ATTR {
        nearest = {bounds[slot], child_of(node, slot)};
        keep_branch(nearest.child);
    });
    const std::size_t base = size;
    for (const std::uint32_t slot : BitsOf(slots & (slots - 1))) {
        StackEntry other = {bounds[slot], child_of(node, slot)};
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
    TraversalStack<StackEntry> stack;
    std::size_t size = 0;
    StackEntry entry = {0, 0};
    for (;;) {
        if (is_leaf(entry.child)) {
            visit_leaf(leaf_of(entry.child));
        } else {
            const Node& node = bvh.nodes[entry.child];
            HWY_ALIGN PerSlot<float> bounds;
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

inline constexpr auto kSkipsNone = [](const Node&) { return false; };

/// Visits the leaves that a ray with main axis kAxis meets, with their least depths, as above.
/// Nodes with skips(node) are left out.
template <int kAxis, class VisitLeaf, class Skips = decltype(kSkipsNone)>
HWY_INLINE void for_each_near_leaf(const Bvh& bvh, const auto& stream, std::size_t ray,
                                   const float& depth, VisitLeaf visit_leaf,
                                   Skips skips = kSkipsNone) {
    const auto near = [&](const Node& node, float* HWY_RESTRICT t_least) HWY_ATTR {
        if (skips(node)) return 0u;
        FloatVec least[kVectors];
        const std::uint32_t met = near_slots<kAxis>(stream, ray, depth, node, least);
        for (std::size_t v = 0; v < kVectors; ++v) store(least[v], t_least + v * kLanes);
        return met;
    };
    for_each_near_leaf(bvh, depth, near,
                       [&](std::uint32_t leaf) HWY_ATTR { visit_leaf(bvh.leaves[leaf]); });
}

/// Takes the first `count` rays of a stream down the tree together, with a mask of rays for each
/// entry of the stack. A node's boxes are tested first for all rays at once and then for each ray.
/// Front to back, an entry has a bound of the least depth of hits in its box, and rays whose
/// last_depth is before it leave the mask when it is popped. `tracer` has
///   kFrontToBack              whether the nearest child comes first, or children in any order
///   last_depths()             the depth up to which each ray looks for hits; any order: last_depth
///   rays_left(rays, t_least)  the rays that look for hits from t_least on
///   stay_together(rays)       whether rays go on together below a node
///   trace_apart(rays, child)  traces rays below this child that do not
///   visit_leaf(rays, leaf)
template <class Tracer>
HWY_INLINE void traverse_together(const Bvh& bvh, const RayStream& stream, std::size_t count,
                                  Tracer& tracer) {
    struct Entry {
        std::uint64_t rays;
        std::uint32_t child;
        float t_least;
    };
    const RayBundle bundle = bundle_of(stream, count);
    const float* const last = tracer.last_depths();
    float farthest = largest_of(last, count);
    TraversalStack<Entry> stack;
    stack[0] = {~std::uint64_t{0} >> (kStreamRays - count), 0, 0};
    for (std::size_t size = 1; size > 0;) {
        const Entry entry = stack[--size];
        const std::uint64_t rays = tracer.rays_left(entry.rays, entry.t_least);
        if (rays == 0) continue;
        if (is_leaf(entry.child)) {
            tracer.visit_leaf(rays, bvh.leaves[leaf_of(entry.child)]);
            continue;
        }
        if (!tracer.stay_together(rays)) {
            tracer.trace_apart(rays, entry.child);
            continue;
        }
        const Node& node = bvh.nodes[entry.child];
        if constexpr (Tracer::kFrontToBack) farthest = largest_of(last, count);
        FloatVec least[kVectors];
        HWY_ALIGN PerSlot<float> t_least;
        const std::uint32_t slots = near_slots(bundle, farthest, node, least);
        if (slots == 0) continue;
        for (std::size_t v = 0; v < kVectors; ++v) store(least[v], t_least + v * kLanes);
        PerSlot<std::uint64_t> met;
        rays_meeting(stream, bundle, last, rays, node, slots, met);
        const std::size_t base = size;
        for (const std::uint32_t slot : BitsOf(slots)) {
            if constexpr (Tracer::kFrontToBack) {
                if (met[slot] == 0) continue;
                insert_sorted(stack, base, size++,
                              Entry{met[slot], child_of(node, slot), t_least[slot]});
            } else {
                assert(size < kMaxStack);
                stack[size] = {met[slot], child_of(node, slot), 0};
                size += met[slot] != 0;
            }
        }
    }
}

// ---- One ray by itself: prepared without vectors, because a vector of one ray takes as long as
// a full one, and traced one node after the other.

using OneRayStream = RaysOfStream<1>;

/// a * b + c as mul_add() rounds it.
HWY_INLINE float mul_add_one(float a, float b, float c) {
    return HWY_NATIVE_FMA ? __builtin_fmaf(a, b, c) : a * b + c;
}

/// prepare_slab() for ray 0 of a stream.
HWY_INLINE void prepare_slab_of_one(OneRayStream& stream, std::uint32_t axis, float org, float dir,
                                    float least) {
    const float rdir = dir == 0 ? kHugeReciprocal : 1.0f / dir;
    const float rdir_far = rdir * kStreamRounding;
    const float dilation =
        (kStreamDilation * std::abs(org) + kLeastDilations * least) * std::abs(rdir);
    stream.rdir[axis][0] = rdir;
    stream.rdir_far[axis][0] = rdir_far;
    stream.k_near[axis][0] = mul_add_one(org, rdir, dilation);
    stream.k_far[axis][0] = mul_add_one(org, rdir_far, -dilation);
    stream.near_offset[axis][0] = plane_offset(axis, rdir < 0 ? 1 : 0);
}

/// A stream of one ray with what closest hits need, with the bits of prepare_rays(). Only vectors
/// of rays need org, dir and the slopes.
HWY_INLINE OneRayStream stream_of_one(const Ray& ray, Crossing crossing = Crossing::kEach) {
    OneRayStream stream;
    stream.crossing = crossing;
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
    return stream;
}

/// prepare_range() for such a ray.
HWY_INLINE void prepare_range_of_one(OneRayStream& stream, const Ray& ray) {
    const float size = mray::extent_of_rays(ray.org);
    const float margin = kCertainDepth * size;
    const float dz = std::abs(stream.sheared_dir[2][0]);
    stream.certain_from[0] = ray.tnear * dz + margin;
    const float end = std::min(ray.tfar * dz, 4.0f * size);
    const bool is_near = size <= kCertainOrigin;
    stream.certain_to[0] = is_near ? end - margin : -1.0f;
    stream.certain_beyond[0] = is_near ? end + kBeyondDepth * size : kHugeReciprocal;
}

template <int kAxis>
HWY_NOINLINE void intersect_ray_along(const Bvh& bvh, const auto& stream, std::size_t ray,
                                      ClosestHits& closest) {
    for_each_near_leaf<kAxis>(bvh, stream, ray, closest.last[ray], [&](const Leaf& leaf) HWY_ATTR {
        intersect_leaf_alone<kAxis>(stream, ray, leaf, closest);
    });
}

HWY_INLINE void intersect_ray(const Bvh& bvh, const auto& stream, std::size_t ray,
                              ClosestHits& closest) {
    const std::uint32_t axis = stream.axis[ray];
    if (axis == 0) return intersect_ray_along<0>(bvh, stream, ray, closest);
    if (axis == 1) return intersect_ray_along<1>(bvh, stream, ray, closest);
    intersect_ray_along<2>(bvh, stream, ray, closest);
}

HWY_NOINLINE inline Hit intersect_one(const Bvh& bvh, const Ray& ray) {
    const OneRayStream stream = stream_of_one(ray);
    ClosestHits closest;
    closest.t[0] = ray.tfar;
    closest.last[0] = stream.last_depth[0];
    closest.u[0] = closest.v[0] = 0;
    closest.prim_id[0] = kNoPrim;
    intersect_ray(bvh, stream, 0, closest);
    return closest.hit(0);
}

template <int kAxis>
HWY_NOINLINE bool occluded_along(const Bvh& bvh, const auto& stream) {
    const auto met = [&](const Node& node) HWY_ATTR { return met_slots(stream, 0, node); };
    return !for_each_leaf(bvh, met, [&](const Leaf& leaf) HWY_ATTR {
        return !occluded_by_leaf<kAxis>(stream, 0, leaf);
    });
}

HWY_NOINLINE inline bool occluded_one(const Bvh& bvh, const Ray& ray) {
    OneRayStream stream = stream_of_one(ray);
    prepare_range_of_one(stream, ray);
    if (stream.axis[0] == 0) return occluded_along<0>(bvh, stream);
    if (stream.axis[0] == 1) return occluded_along<1>(bvh, stream);
    return occluded_along<2>(bvh, stream);
}

// ---- Rays that go on alone, with the 16 boxes of a node or the triangles of a leaf for lanes.
// Many take steps in turn, so that none waits for one node to know the next: each round pops an
// entry off every ray's stack, then tests all nodes, then all leaves, without branches on data.
//
// A stack holds (key, child), the nearest on top. A key is the bits of t_least, which is not
// negative, rounded down to a multiple of 16 ulp, plus the slot: keys order as the floats do, and
// rounding down loses no box. Up to 8 entries are written beyond the last of kMaxStack
// (docs/design/layout.md).

#undef MORPHRAY_SORTED_IN_VECTORS
#if HWY_TARGET <= HWY_AVX3 && HWY_ARCH_X86
#define MORPHRAY_SORTED_IN_VECTORS 1
using FourTag = hn::FixedTag<std::uint32_t, 4>;
using EightTag = hn::FixedTag<std::uint32_t, 8>;

/// The first lanes of a vector, and a vector that begins with these lanes.
HWY_INLINE hn::Vec<EightTag> first_lanes(EightTag d, UintVec v) { return hn::LowerHalf(d, v); }
HWY_INLINE hn::Vec<FourTag> first_lanes(FourTag d, UintVec v) {
    return hn::LowerHalf(d, first_lanes(EightTag(), v));
}
HWY_INLINE UintVec extended(hn::Vec<EightTag> v) { return hn::ZeroExtendVector(kUints, v); }
HWY_INLINE UintVec extended(hn::Vec<FourTag> v) {
    return extended(hn::ZeroExtendVector(EightTag(), v));
}

/// A layer of a sorting network: each lane and its partner are ordered, the larger one first.
template <std::uint32_t... partners, class D>
HWY_INLINE hn::Vec<D> sort_partners(D d, hn::Vec<D> v) {
    alignas(32) static constexpr std::uint32_t kPartner[] = {partners...};
    constexpr unsigned kIsSecond = [] {
        unsigned bits = 0;
        for (unsigned i = 0; i < sizeof...(partners); ++i) bits |= (kPartner[i] < i ? 1u : 0u) << i;
        return bits;
    }();
    const std::uint8_t is_second[8] = {static_cast<std::uint8_t>(kIsSecond)};
    const auto w = hn::TableLookupLanes(v, hn::SetTableIndices(d, kPartner));
    return hn::IfThenElse(hn::LoadMaskBits(d, is_second), hn::Min(v, w), hn::Max(v, w));
}

/// Batcher's network for four numbers.
HWY_INLINE hn::Vec<FourTag> sort_descending(FourTag d, hn::Vec<FourTag> v) {
    v = sort_partners<1, 0, 3, 2>(d, v);
    v = sort_partners<2, 3, 0, 1>(d, v);
    return sort_partners<0, 2, 1, 3>(d, v);
}

HWY_INLINE hn::Vec<EightTag> sort_descending(EightTag d, hn::Vec<EightTag> v) {
    v = sort_partners<1, 0, 3, 2, 5, 4, 7, 6>(d, v);
    v = sort_partners<2, 3, 0, 1, 6, 7, 4, 5>(d, v);
    v = sort_partners<0, 2, 1, 3, 4, 6, 5, 7>(d, v);
    v = sort_partners<4, 5, 6, 7, 0, 1, 2, 3>(d, v);
    v = sort_partners<0, 1, 4, 5, 2, 3, 6, 7>(d, v);
    return sort_partners<0, 2, 1, 4, 3, 6, 5, 7>(d, v);
}
#else
#define MORPHRAY_SORTED_IN_VECTORS 0
#endif

/// Some rays of a stream, each below a child of the tree, which are traced together.
class SingleRays {
public:
    static constexpr std::size_t kMost = 64;

    bool has_room_for(std::size_t count) const { return count_ + count <= kMost; }

    /// Requires has_room_for(1). The same ray may be added several times.
    HWY_INLINE void add(std::uint32_t ray, std::uint32_t child) {
        assert(count_ < kMost);
        paths_[count_].size = 1;
        paths_[count_].ray = ray;
        paths_[count_].key[0] = 0;
        paths_[count_++].child[0] = child;
    }

    /// Finds the closest hits of all rays that were added, and removes these.
    HWY_INLINE void intersect(const Bvh& bvh, const RayStream& stream, ClosestHits& closest) {
        std::uint8_t left[kMost];
        std::size_t count = std::exchange(count_, 0);
        for (std::size_t i = 0; i < count; ++i) left[i] = static_cast<std::uint8_t>(i);
        while (count > 0) {
            Visits nodes, leaves;
            for (std::size_t k = 0; k < count; ++k) {
                Path& path = paths_[left[k]];
                const std::size_t top = --path.size;
                const auto t_least = std::bit_cast<float>(path.key[top] & ~kSlotBits);
                const bool reached = t_least <= closest.last[path.ray];
                const std::uint32_t child = path.child[top];
                nodes.add(reached && !is_leaf(child), left[k], child);
                leaves.add(reached && is_leaf(child), left[k], leaf_of(child));
            }
            for (std::size_t k = 0; k < leaves.count; ++k)
                prefetch(bvh.leaves[leaves.index[k]].vertex, sizeof(Leaf::vertex));
            for (std::size_t k = 0; k < nodes.count; ++k)
                push_children(stream, closest, bvh.nodes[nodes.index[k]], paths_[nodes.path[k]]);
            for (std::size_t k = 0; k < leaves.count; ++k) {
                intersect_leaf_alone(stream, paths_[leaves.path[k]].ray,
                                     bvh.leaves[leaves.index[k]], closest);
            }
            std::size_t kept = 0;
            for (std::size_t k = 0; k < count; ++k) {
                left[kept] = left[k];
                kept += paths_[left[k]].size != 0;
            }
            count = kept;
        }
    }

private:
    // The low bits of a key, which is a t_least rounded down, hold the slot.
    static constexpr std::uint32_t kSlotBits = kWidth - 1;

    /// A ray and its stack, nearest on top. Whole vectors are written beyond the last entry.
    struct Path {
        std::uint32_t key[kMaxStack + 8], child[kMaxStack + 8];
        std::uint32_t ray, size;
    };

    /// The paths at a node, or at a leaf.
    struct Visits {
        std::uint8_t path[kMost];
        std::uint32_t index[kMost];
        std::size_t count = 0;

        HWY_INLINE void add(bool is_one, std::uint8_t path_index, std::uint32_t at) {
            path[count] = path_index;
            index[count] = at;
            count += is_one;
        }
    };

#if MORPHRAY_SORTED_IN_VECTORS
    /// Writes the keys and children in these slots, as many as there are lanes or fewer.
    template <class D>
    HWY_INLINE static void write_sorted(D d, const Node& node, std::uint32_t slots,
                                        std::size_t count, FloatVec least, std::uint32_t* key,
                                        std::uint32_t* child) {
        const UintVec keys = (as_uint(least) & splat(~kSlotBits)) | hn::Iota(kUints, 0u);
        const auto some = first_lanes(d, hn::Compress(keys, uint_mask(mask_of(slots))));
        const auto sorted = sort_descending(d, hn::IfThenElseZero(hn::FirstN(d, count), some));
        hn::StoreU(sorted, d, key);
        const UintVec places = extended(sorted) & splat(kSlotBits);
        const UintVec children =
            hn::TableLookupLanes(children_of(node, 0), hn::IndicesFromVec(kUints, places));
        hn::StoreU(first_lanes(d, children), d, child);
    }
#endif

    HWY_INLINE static void push_children(const RayStream& stream, const ClosestHits& closest,
                                         const Node& node, Path& path) {
        FloatVec least[kVectors];
        const std::uint32_t met = near_slots(stream, path.ray, closest.last[path.ray], node, least);
        const auto count = static_cast<std::uint32_t>(std::popcount(met));
        std::uint32_t* const key = path.key + path.size;
        std::uint32_t* const child = path.child + path.size;
        path.size += count;
        assert(path.size <= kMaxStack);
#if MORPHRAY_SORTED_IN_VECTORS
        if (count <= 4) return write_sorted(FourTag(), node, met, count, least[0], key, child);
        if (count <= 8) return write_sorted(EightTag(), node, met, count, least[0], key, child);
#endif
        HWY_ALIGN PerSlot<float> t_least;
        for (std::size_t v = 0; v < kVectors; ++v) store(least[v], t_least + v * kLanes);
        std::size_t size = 0;
        for (const std::uint32_t slot : BitsOf(met)) {
            const std::uint32_t k =
                (std::bit_cast<std::uint32_t>(t_least[slot]) & ~kSlotBits) | slot;
            std::size_t place = size++;
            for (; place > 0 && key[place - 1] < k; --place) {
                key[place] = key[place - 1];
                child[place] = child[place - 1];
            }
            key[place] = k;
            child[place] = child_of(node, slot);
        }
    }

    std::size_t count_ = 0;
    Path paths_[kMost];
};

// ---- Closest hits of a stream, front to back. Where few rays are left they go on alone.

// Rays go on together below a node if they are more than this many (lab/notes/cpu_tracer.md).
inline constexpr std::size_t kTogetherAtNode = kLanes < 8 ? 4 : kLanes == 8 ? 8 : 16;
// Fewer rays than these are traced one after the other.
inline constexpr std::size_t kFewRays = 4;

class ClosestStream {
public:
    /// rays[order[i]], of one octant: at least one and at most kStreamRays. They go on together
    /// below a node if they are more than `together`, at most kTogetherAtNode.
    HWY_INLINE ClosestStream(const Bvh& bvh, const Ray* rays, std::span<const std::uint16_t> order,
                             std::size_t together = kTogetherAtNode)
        : bvh_(bvh),
          order_(order),
          together_(together),
          stream_(make_stream(rays, order)),
          closest_(stream_, order.size()) {}

    HWY_INLINE void intersect(Hit* hits) {
        const std::size_t count = order_.size();
        if (count > together_) {
            traverse_together(bvh_, stream_, count, *this);
            single_rays_.intersect(bvh_, stream_, closest_);
        } else if (count >= kFewRays) {
            for (std::uint32_t i = 0; i < count; ++i) single_rays_.add(i, 0);
            single_rays_.intersect(bvh_, stream_, closest_);
        } else {
            for (std::size_t i = 0; i < count; ++i) intersect_ray(bvh_, stream_, i, closest_);
        }
        for (std::size_t i = 0; i < count; ++i) hits[order_[i]] = closest_.hit(i);
    }

    // For traverse_together().
    static constexpr bool kFrontToBack = true;
    HWY_INLINE const float* last_depths() const { return closest_.last; }
    HWY_INLINE std::uint64_t rays_left(std::uint64_t rays, float t) const {
        std::uint64_t left = 0;
        for (std::size_t first = 0; first < kStreamRays; first += kLanes)
            left |= std::uint64_t{bits_of(load(closest_.last + first) >= t)} << first;
        return left & rays;
    }
    HWY_INLINE bool stay_together(std::uint64_t rays) const {
        return static_cast<std::size_t>(std::popcount(rays)) > together_;
    }
    HWY_INLINE void trace_apart(std::uint64_t rays, std::uint32_t child) {
        if (!single_rays_.has_room_for(kTogetherAtNode))
            single_rays_.intersect(bvh_, stream_, closest_);
        for (const std::uint32_t ray : BitsOf(rays)) single_rays_.add(ray, child);
    }
    HWY_INLINE void visit_leaf(std::uint64_t rays, const Leaf& leaf) {
        for_rays_of_leaf(
            rays,
            [&](std::size_t first, std::uint32_t active)
                HWY_ATTR { intersect_leaf_together(stream_, first, active, leaf, closest_); },
            [&](std::size_t ray) HWY_ATTR { intersect_leaf_alone(stream_, ray, leaf, closest_); });
    }

private:
    const Bvh& bvh_;
    std::span<const std::uint16_t> order_;
    std::size_t together_;
    RayStream stream_;
    ClosestHits closest_;
    SingleRays single_rays_;
};

// ---- Any hits of a stream, which goes down the tree in no order as long as enough rays are left
// to fill the lanes of vectors. Then rays go on alone, as a stack of (ray, node). The topmost
// kChunk entries are popped together and tested in a loop without a branch that depends on data;
// met leaves are gathered and tested in a second such loop.
//
// With an entry all later generations of descendants are popped, and at most kWidth * kChunk come
// back: the stack has kSeeds entries of generation 0, and at most kWidth * kChunk of each other
// one.

inline constexpr std::size_t kChunk = 32;
inline constexpr std::size_t kSeeds = 1024;
inline constexpr std::size_t kItems = kSeeds + (kMaxDepth - 1) * kWidth * kChunk;

// A node or a leaf is tested for many rays at a time if these are more than this many per vector
// that has any of them (lab/notes/cpu_tracer.md).
inline constexpr std::size_t kSharedByNode = kLanes < 4 ? 1 : kLanes < 8 ? 2 : kLanes < 16 ? 4 : 6;
inline constexpr std::size_t kSharedByLeaf = kLanes < 8 ? 1 : kLanes == 8 ? 2 : 5;

/// Entries of two parallel arrays. Reading whole chunks may go below the first entry, and writing
/// whole vectors beyond the last one.
template <std::size_t kCapacity>
struct WorkItems {
    std::uint32_t child[kChunk + kCapacity + kWidth], ray[kChunk + kCapacity + kWidth];
};

/// Appends the children in these slots for a ray; returns the new size.
template <std::size_t kCapacity>
HWY_INLINE std::size_t append(const Node& node, std::uint32_t slots, std::uint32_t ray,
                              WorkItems<kCapacity>& items, std::size_t size) {
    std::uint32_t* child = items.child + kChunk + size;
    std::uint32_t* of_ray = items.ray + kChunk + size;
    const auto count = static_cast<std::size_t>(std::popcount(slots));
    assert(size + count <= kCapacity);
    if constexpr (kVectors == 1) {
        const auto bits = static_cast<std::uint16_t>(slots);
        std::uint8_t bytes[8] = {};
        std::memcpy(bytes, &bits, sizeof bits);
        const UintMask which = hn::LoadMaskBits(kUints, bytes);
        store_unaligned(hn::Compress(children_of(node, 0), which), child);
        store_unaligned(splat(ray), of_ray);
        return size + count;
    }
    // Two without a branch; more are rare.
    for (std::size_t i = 0; i < 2; ++i) {
        child[i] = child_of(node, first_bit(slots | 1u << (kWidth - 1)));
        of_ray[i] = ray;
        slots &= slots - 1;
    }
    for (std::size_t i = 2; slots != 0; ++i) {
        child[i] = child_of(node, first_bit(slots));
        of_ray[i] = ray;
        slots &= slots - 1;
    }
    return size + count;
}

class OccludedStream {
public:
    /// rays[order[i]], of one octant: at least one and at most kStreamRays.
    HWY_INLINE OccludedStream(const Bvh& bvh, const Ray* rays, std::span<const std::uint16_t> order)
        : bvh_(bvh),
          stream_(make_stream(rays, order)),
          left_(~std::uint64_t{0} >> (kStreamRays - order.size())) {}

    HWY_INLINE std::uint64_t trace() {
        const std::uint64_t all = left_;
        if (is_worth_sharing(all, kSharedByNode)) {
            traverse_together(bvh_, stream_, static_cast<std::size_t>(std::popcount(all)), *this);
        } else {
            trace_apart(all, 0);
        }
        trace_seeds();
        return all & ~left_;
    }

    // For traverse_together().
    static constexpr bool kFrontToBack = false;
    HWY_INLINE const float* last_depths() const { return stream_.last_depth; }
    HWY_INLINE std::uint64_t rays_left(std::uint64_t rays, float) const { return rays & left_; }
    HWY_INLINE bool stay_together(std::uint64_t rays) const {
        return is_worth_sharing(rays, kSharedByNode);
    }
    HWY_INLINE void trace_apart(std::uint64_t rays, std::uint32_t child) {
        if (seed_count_ + kStreamRays > kSeeds) trace_seeds();
        for (const std::uint32_t ray : BitsOf(rays)) {
            inner_.child[kChunk + seed_count_] = child;
            inner_.ray[kChunk + seed_count_++] = ray;
        }
    }
    HWY_INLINE void visit_leaf(std::uint64_t rays, const Leaf& leaf) {
        if (is_worth_sharing(rays, kSharedByLeaf)) {
            left_ &= ~rays_hitting(stream_, rays, leaf);
            return;
        }
        for (const std::uint32_t ray : BitsOf(rays)) trace_leaf_alone(ray, leaf);
    }

private:
    HWY_INLINE static bool is_worth_sharing(std::uint64_t rays, std::size_t rays_of_vector) {
        std::size_t vectors = 0;
        for (std::size_t first = 0; first < kStreamRays; first += kLanes)
            vectors += (rays >> first & kLaneBits) != 0;
        return static_cast<std::size_t>(std::popcount(rays)) > vectors * rays_of_vector;
    }

    HWY_INLINE void trace_leaf_alone(std::uint32_t ray, const Leaf& leaf) {
        const bool hit = occluded_by_leaf(stream_, ray, leaf);
        left_ &= ~(std::uint64_t{hit} << ray);
    }

    HWY_INLINE void trace_seeds() {
        std::size_t size = seed_count_;
        seed_count_ = 0;
        while (size > 0) {
            std::uint32_t child[kChunk], ray[kChunk];
            std::memcpy(child, inner_.child + size, sizeof child);
            std::memcpy(ray, inner_.ray + size, sizeof ray);
            const std::size_t count = std::min(size, kChunk);
            size -= count;
            std::size_t leaf_count = 0;
            for (std::size_t i = kChunk - count; i < kChunk; ++i) {
                if ((left_ >> ray[i] & 1) == 0) continue;
                const Node& node = bvh_.nodes[child[i]];
                const std::uint32_t met = met_slots(stream_, ray[i], node);
                const std::uint32_t leaves = leaf_slots(node);
                size = append(node, met & ~leaves, ray[i], inner_, size);
                leaf_count = append(node, met & leaves, ray[i], outer_, leaf_count);
            }
            trace_gathered_leaves(leaf_count);
        }
    }

    HWY_INLINE void trace_gathered_leaves(std::size_t count) {
        const auto leaf = [this](std::size_t i) -> const Leaf& {
            return bvh_.leaves[leaf_of(outer_.child[kChunk + i])];
        };
        for (std::size_t i = 0; i < count; ++i) prefetch(leaf(i).vertex, sizeof(Leaf::vertex));
        for (std::size_t i = 0; i < count; ++i) {
            // A ray often meets several leaves of a chunk, and hits something in an earlier one.
            const std::uint32_t ray = outer_.ray[kChunk + i];
            if ((left_ >> ray & 1) != 0) trace_leaf_alone(ray, leaf(i));
        }
    }

    const Bvh& bvh_;
    RayStream stream_;
    std::uint64_t left_;
    std::size_t seed_count_ = 0;
    WorkItems<kItems> inner_;
    WorkItems<kWidth * kChunk> outer_;
};

}  // namespace mray::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
