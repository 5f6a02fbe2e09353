// The traversals of cpu/wide_tracer.h, compiled once for each target.
//
// Which boxes are met is decided by the operations of hits_box, and which triangles are hit by
// intersect_triangle itself, on what possible_triangles leaves; so the answers have the bits of
// ScalarTracer. The order in which a ray's triangles come does not matter: the winner is the least
// in a total order, and boxes are culled only beyond the best t.
#if defined(MORPHRAY_CPU_WIDE_TRACER_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_WIDE_TRACER_INL_H
#undef MORPHRAY_CPU_WIDE_TRACER_INL_H
#else
#define MORPHRAY_CPU_WIDE_TRACER_INL_H
#endif

#include <algorithm>
#include <bit>
#include <cassert>
#include <cstddef>
#include <cstring>
#include <span>

#include "common/bvh.h"
#include "cpu/ray_stream-inl.h"
#include "cpu/wide_leaf-inl.h"
#include "cpu/wide_node-inl.h"

HWY_BEFORE_NAMESPACE();
namespace morphray::cpu {
namespace HWY_NAMESPACE {

/// The scalar rule for the triangle in a slot of a leaf.
HWY_INLINE bool intersect_slot(const ShearedRay& sheared, const Ray& ray, const Leaf& leaf,
                               std::uint32_t slot, TriangleHit& hit) {
    return intersect_triangle(sheared, ray.tnear, ray.tfar, leaf_position(leaf, slot, 0),
                              leaf_position(leaf, slot, 1), leaf_position(leaf, slot, 2), hit);
}

/// Calls visit(slot) for the triangles that possible_triangles has set.
template <class Visit>
HWY_INLINE void for_each_triangle(std::uint32_t triangles, Visit visit) {
    for (; triangles != 0; triangles &= triangles - 1) {
        visit(slot_of_lane(static_cast<std::uint32_t>(std::countr_zero(triangles))));
    }
}

// ---- Closest hit: one ray after the other, its nearest box first.

struct WideEntry {
    float t_enter;
    std::uint32_t child;
};

/// Pushes the children in these slots so that the nearest comes to lie on top; returns the new
/// size.
HWY_INLINE std::size_t push_sorted(const Node& node, std::uint32_t slots, const float* t_enter,
                                   WideEntry* stack, std::size_t size) {
    const std::size_t base = size;
    for (; slots != 0; slots &= slots - 1) {
        const auto slot = static_cast<std::uint32_t>(std::countr_zero(slots));
        assert(size < kMaxStack);
        std::size_t place = size++;
        for (; place > base && stack[place - 1].t_enter < t_enter[slot]; --place) {
            stack[place] = stack[place - 1];
        }
        stack[place] = {t_enter[slot], node.child[slot]};
    }
    return size;
}

HWY_INLINE Hit intersect_ray(const Bvh& bvh, const Ray& ray, const RayStream& stream,
                             std::size_t id) {
    Hit best = no_hit();
    float best_t = ray.tfar;
    WideEntry stack[kMaxStack];
    stack[0] = {0, 0};
    for (std::size_t size = 1; size > 0;) {
        const WideEntry entry = stack[--size];
        if (entry.t_enter > best_t) continue;
        if ((entry.child & kLeafBit) == 0) {
            const Node& node = bvh.nodes[entry.child];
            FloatVec enter[kVectors];
            const std::uint32_t met = met_slots(stream, id, best_t, node, enter);
            HWY_ALIGN float t_enter[kWidth];
            for (std::size_t v = 0; v < kVectors; ++v) {
                hn::Store(enter[v], kFloats, t_enter + v * kLanes);
            }
            size = push_sorted(node, met, t_enter, stack, size);
            continue;
        }
        const Leaf& leaf = bvh.leaves[entry.child & ~kLeafBit];
        const std::uint32_t triangles = possible_triangles(stream, id, leaf);
        if (triangles == 0) continue;
        const ShearedRay sheared = shear_ray(ray.org, ray.dir);
        for_each_triangle(triangles, [&](std::uint32_t slot) {
            TriangleHit hit;
            if (intersect_slot(sheared, ray, leaf, slot, hit) &&
                wins(hit.t, leaf.prim_id[slot], best_t, best.prim_id)) {
                best_t = hit.t;
                best = make_hit(hit, leaf.prim_id[slot]);
            }
        });
    }
    return best;
}

// ---- Any hit: many rays at once, in no order.
//
// The work is a stack of (ray, node). The topmost kChunk are taken together and tested in a loop
// without a branch that depends on data, which neither waits for one node to know the next nor
// mispredicts; met leaves are gathered and tested in a second such loop.
//
// The stack. Levels of the tree do not decrease from bottom to top: a chunk's children are pushed
// in the order of their parents, on what is left, which is no deeper than the first of the chunk.
// So when an entry of level l - 1 is taken, all of level l and deeper are taken with it, and at
// most kWidth * kChunk of level l and deeper come back. By induction from the deepest level, at
// most kWidth * kChunk of each level but the first are on the stack at a time, and kStreamRays of
// that.

inline constexpr std::size_t kChunk = 32;
inline constexpr std::size_t kItems = kStreamRays + (kMaxDepth - 1) * kWidth * kChunk;

/// Entries of two parallel arrays. Reading whole chunks may go below the first entry, and writing
/// whole vectors beyond the last one.
template <std::size_t kCapacity>
struct WorkItems {
    std::uint32_t child[kChunk + kCapacity + kWidth];
    std::uint32_t ray[kChunk + kCapacity + kWidth];
};

/// Adds the children in these slots; returns the new size.
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
        hn::StoreU(hn::Compress(hn::LoadU(kUints, node.child), which), kUints, child);
        hn::StoreU(hn::Set(kUints, ray), kUints, of_ray);
        return size + count;
    }
    // Two without a branch, more seldom follow.
    for (std::size_t i = 0; i < 2; ++i) {
        child[i] = node.child[std::countr_zero(slots | 1u << (kWidth - 1))];
        of_ray[i] = ray;
        slots &= slots - 1;
    }
    for (std::size_t i = 2; slots != 0; ++i) {
        child[i] = node.child[std::countr_zero(slots)];
        of_ray[i] = ray;
        slots &= slots - 1;
    }
    return size + count;
}

/// At most kStreamRays rays.
HWY_INLINE void occluded_stream(const Bvh& bvh, std::span<const Ray> rays, std::uint8_t* occluded) {
    RayStream stream;
    fill_stream(stream, rays);
    WorkItems<kItems> inner;
    WorkItems<kWidth * kChunk> outer;
    std::size_t size = rays.size();
    for (std::size_t i = 0; i < size; ++i) {
        occluded[i] = 0;
        inner.child[kChunk + i] = 0;
        inner.ray[kChunk + i] = static_cast<std::uint32_t>(i);
    }
    while (size > 0) {
        std::uint32_t child[kChunk];
        std::uint32_t ray[kChunk];
        std::memcpy(child, inner.child + size, sizeof child);
        std::memcpy(ray, inner.ray + size, sizeof ray);
        const std::size_t count = std::min(size, kChunk);
        size -= count;
        std::size_t leaf_count = 0;
        for (std::size_t i = kChunk - count; i < kChunk; ++i) {
            if (occluded[ray[i]] != 0) continue;
            const Node& node = bvh.nodes[child[i]];
            FloatVec t_enter[kVectors];
            const std::uint32_t met = met_slots(stream, ray[i], stream.tfar[ray[i]], node, t_enter);
            const std::uint32_t leaves = leaf_slots(node);
            size = append(node, met & ~leaves, ray[i], inner, size);
            leaf_count = append(node, met & leaves, ray[i], outer, leaf_count);
        }
        for (std::size_t i = 0; i < leaf_count; ++i) {
            const std::uint32_t id = outer.ray[kChunk + i];
            const Leaf& leaf = bvh.leaves[outer.child[kChunk + i] & ~kLeafBit];
            const std::uint32_t triangles = possible_triangles(stream, id, leaf);
            if (triangles == 0 || occluded[id] != 0) continue;
            const ShearedRay sheared = shear_ray(rays[id].org, rays[id].dir);
            for_each_triangle(triangles, [&](std::uint32_t slot) {
                TriangleHit hit;
                if (intersect_slot(sheared, rays[id], leaf, slot, hit)) occluded[id] = 1;
            });
        }
    }
}

// ---- Entry points

void intersect_rays(const Bvh& bvh, std::span<const Ray> rays, std::span<Hit> hits) {
    for (std::size_t first = 0; first < rays.size(); first += kStreamRays) {
        const auto part = rays.subspan(first, std::min(kStreamRays, rays.size() - first));
        RayStream stream;
        fill_stream(stream, part);
        for (std::size_t i = 0; i < part.size(); ++i) {
            hits[first + i] = intersect_ray(bvh, part[i], stream, i);
        }
    }
}

void occluded_rays(const Bvh& bvh, std::span<const Ray> rays, std::span<std::uint8_t> occluded) {
    for (std::size_t first = 0; first < rays.size(); first += kStreamRays) {
        const auto part = rays.subspan(first, std::min(kStreamRays, rays.size() - first));
        occluded_stream(bvh, part, occluded.data() + first);
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace morphray::cpu
HWY_AFTER_NAMESPACE();

#endif  // per target
