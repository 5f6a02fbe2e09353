// The traversals of cpu/single_ray/single_ray_tracer.h, compiled once for each target.
//
// All boxes that hold a hit are met, and the hit rule decides which triangles are hit, so the
// answers have the bits of ScalarTracer. The order of a ray's triangles does not matter: the
// closest hit is the least in a total order (is_closer), and boxes are culled only beyond the
// closest t.
#if defined(MORPHRAY_CPU_SINGLE_RAY_SINGLE_RAY_TRACER_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_SINGLE_RAY_SINGLE_RAY_TRACER_INL_H
#undef MORPHRAY_CPU_SINGLE_RAY_SINGLE_RAY_TRACER_INL_H
#else
#define MORPHRAY_CPU_SINGLE_RAY_SINGLE_RAY_TRACER_INL_H
#endif

#include <algorithm>
#include <bit>
#include <cassert>
#include <cstddef>
#include <span>

#include "common/bvh/bvh.h"
#include "cpu/single_ray/leaf_hit_rule-inl.h"
#include "cpu/single_ray/node_lanes-inl.h"
#include "cpu/single_ray/ray_stream-inl.h"
#include "cpu/single_ray/stream_occluded-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {
using namespace simd::HWY_NAMESPACE;

// Closest hits are found one ray after the other, its nearest box first.

struct StackEntry {
    float t_enter;
    std::uint32_t child;
};

/// Pushes the children in these slots so that the nearest is on top; returns the new size.
HWY_INLINE std::size_t push_sorted(const Node& node, std::uint32_t slots, const float* t_enter,
                                   StackEntry* stack, std::size_t size) {
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

HWY_INLINE Hit intersect_ray(const Bvh& bvh, const RayStream& stream, std::size_t id) {
    Hit closest = no_hit();
    float closest_t = stream.tfar[id];
    StackEntry stack[kMaxStack];
    stack[0] = {0, 0};
    for (std::size_t size = 1; size > 0;) {
        const StackEntry entry = stack[--size];
        if (entry.t_enter > closest_t) continue;
        if ((entry.child & kLeafBit) == 0) {
            const Node& node = bvh.nodes[entry.child];
            FloatVec enter[kVectors];
            const std::uint32_t met = met_slots(stream, id, closest_t, node, enter);
            HWY_ALIGN float t_enter[kWidth];
            for (std::size_t v = 0; v < kVectors; ++v) {
                store(enter[v], t_enter + v * kLanes);
            }
            size = push_sorted(node, met, t_enter, stack, size);
            continue;
        }
        const Leaf& leaf = bvh.leaves[entry.child & ~kLeafBit];
        intersect_leaf(stream, id, closest_t, leaf,
                       [&](std::uint32_t slot, const TriangleHit& hit) {
                           if (is_closer(hit.t, leaf.prim_id[slot], closest_t, closest.prim_id)) {
                               closest_t = hit.t;
                               closest = make_hit(hit, leaf.prim_id[slot]);
                           }
                           return false;
                       });
    }
    return closest;
}

void intersect_rays(const Bvh& bvh, std::span<const Ray> rays, std::span<Hit> hits) {
    for (std::size_t first = 0; first < rays.size(); first += kStreamRays) {
        const auto part = rays.subspan(first, std::min(kStreamRays, rays.size() - first));
        RayStream stream;
        fill_stream(stream, part);
        for (std::size_t i = 0; i < part.size(); ++i) {
            hits[first + i] = intersect_ray(bvh, stream, i);
        }
    }
}

void occluded_rays(const Bvh& bvh, std::span<const Ray> rays, std::span<std::uint8_t> occluded) {
    for (std::size_t first = 0; first < rays.size(); first += kStreamRays) {
        const std::size_t count = std::min(kStreamRays, rays.size() - first);
        const std::uint64_t hits = OccludedStream(bvh, rays.subspan(first, count)).trace();
        for (std::size_t i = 0; i < count; ++i) occluded[first + i] = hits >> i & 1;
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif  // per target
