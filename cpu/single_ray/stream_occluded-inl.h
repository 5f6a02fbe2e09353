// Whether rays hit anything: a stream of up to 64 rays of one octant at once, in no order.
//
// The rays of a stream go down the tree together (cpu/single_ray/walks-inl.h) as long as enough of
// them are left to fill the lanes of vectors. Where few are left, each goes on alone, with the 16
// boxes or triangles for lanes.
//
// The work of rays that go on alone is a stack of (ray, node). The topmost kChunk entries are taken
// together and tested in a loop without a branch that depends on data, which neither waits for one
// node to know the next nor mispredicts; met leaves are gathered and tested in a second such loop.
//
// The size of this stack:
// 1. Entries from the shared part have generation 0, children one more than their parents.
// 2. Generations do not decrease from bottom to top: a chunk's children are pushed in the order of
//    their parents, on entries that are no later than the first of the chunk.
// 3. So when an entry of generation g - 1 is taken, all of g and later are taken with it, and at
//    most kWidth * kChunk of g and later come back.
// 4. By induction from the last generation, at most kWidth * kChunk of each generation but the
//    first are on the stack at a time, and kSeeds of the first.
#if defined(MORPHRAY_CPU_SINGLE_RAY_STREAM_OCCLUDED_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_SINGLE_RAY_STREAM_OCCLUDED_INL_H
#undef MORPHRAY_CPU_SINGLE_RAY_STREAM_OCCLUDED_INL_H
#else
#define MORPHRAY_CPU_SINGLE_RAY_STREAM_OCCLUDED_INL_H
#endif

#include <algorithm>
#include <bit>
#include <cassert>
#include <cstddef>
#include <cstring>
#include <span>

#include "common/bvh/bvh.h"
#include "cpu/single_ray/closest_leaf-inl.h"
#include "cpu/single_ray/leaf_hit_rule-inl.h"
#include "cpu/single_ray/node_lanes-inl.h"
#include "cpu/single_ray/ray_stream-inl.h"
#include "cpu/single_ray/walks-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {
using namespace simd::HWY_NAMESPACE;

inline constexpr std::size_t kChunk = 32;
inline constexpr std::size_t kSeeds = 1024;
inline constexpr std::size_t kItems = kSeeds + (kMaxDepth - 1) * kWidth * kChunk;

// A node or a leaf is tested for many rays at a time if these are more than this many per vector
// that has any of them (lab/notes/cpu_tracer.md has the figures).
inline constexpr std::size_t kSharedByNode = kLanes == 1   ? 1
                                             : kLanes == 4 ? 2
                                             : kLanes == 8 ? 4
                                                           : 6;
inline constexpr std::size_t kSharedByLeaf = kLanes < 8 ? 1 : kLanes == 8 ? 2 : 5;

/// Entries of two parallel arrays. Reading whole chunks may go below the first entry, and writing
/// whole vectors beyond the last one.
template <std::size_t kCapacity>
struct WorkItems {
    std::uint32_t child[kChunk + kCapacity + kWidth];
    std::uint32_t ray[kChunk + kCapacity + kWidth];
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
        store_unaligned(hn::Compress(load_unaligned(node.child), which), child);
        store_unaligned(splat(ray), of_ray);
        return size + count;
    }
    // Two without a branch; more are rare.
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

class OccludedStream {
public:
    /// rays[order[i]], of one octant: at least one and at most kStreamRays.
    HWY_INLINE OccludedStream(const Bvh& bvh, const Ray* rays, std::span<const std::uint16_t> order)
        : bvh_(bvh),
          stream_(make_stream(rays, order)),
          left_(~std::uint64_t{0} >> (kStreamRays - order.size())) {}

    /// The rays that hit anything, as bits.
    HWY_INLINE std::uint64_t trace() {
        const std::uint64_t all = left_;
        if (is_worth_sharing(all, kSharedByNode)) {
            walk_together(bvh_, stream_, static_cast<std::size_t>(std::popcount(all)), *this);
        } else {
            part(all, 0);
        }
        trace_seeds();
        return all & ~left_;
    }

    // For walk_together().
    static constexpr bool kFrontToBack = false;
    HWY_INLINE const float* last_depths() const { return stream_.last_depth; }
    HWY_INLINE std::uint64_t rays_left(std::uint64_t rays, float) const { return rays & left_; }
    HWY_INLINE bool stay_together(std::uint64_t rays) const {
        return is_worth_sharing(rays, kSharedByNode);
    }
    HWY_INLINE void part(std::uint64_t rays, std::uint32_t child) {
        if (seed_count_ + kStreamRays > kSeeds) trace_seeds();
        for (; rays != 0; rays &= rays - 1) {
            inner_.child[kChunk + seed_count_] = child;
            inner_.ray[kChunk + seed_count_++] = static_cast<std::uint32_t>(std::countr_zero(rays));
        }
    }
    HWY_INLINE void visit_leaf(std::uint64_t rays, const Leaf& leaf) {
        if (is_worth_sharing(rays, kSharedByLeaf)) {
            left_ &= ~rays_hitting(stream_, rays, leaf);
            return;
        }
        for (; rays != 0; rays &= rays - 1)
            trace_leaf_alone(static_cast<std::uint32_t>(std::countr_zero(rays)), leaf);
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
            std::uint32_t child[kChunk];
            std::uint32_t ray[kChunk];
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
            return bvh_.leaves[outer_.child[kChunk + i] & ~kLeafBit];
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
    /// The rays that have hit nothing yet, as bits.
    std::uint64_t left_;
    std::size_t seed_count_ = 0;
    WorkItems<kItems> inner_;
    WorkItems<kWidth * kChunk> outer_;
};

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif  // per target
