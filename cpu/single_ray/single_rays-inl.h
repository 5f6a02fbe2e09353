// Closest hits of rays that go on alone, with the 16 boxes of a node or the triangles of a leaf for
// lanes. Many take steps in turn, so that none waits for one node to know the next: each round
// takes an entry off every ray's stack, tests all nodes among them, then all leaves, in loops
// without a branch that depends on data.
//
// A stack holds (key, child), the nearest on top. A key is the bits of t_least, which is not
// negative, rounded down to a multiple of 16 ulp, plus the slot: keys order as the floats do, and
// rounding down loses no box. The stack of a ray takes a node off and pushes its up to 16 children,
// so kMaxStack entries suffice (docs/design/layout.md), and up to 8 are written beyond the last.
#if defined(MORPHRAY_CPU_SINGLE_RAY_SINGLE_RAYS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_SINGLE_RAY_SINGLE_RAYS_INL_H
#undef MORPHRAY_CPU_SINGLE_RAY_SINGLE_RAYS_INL_H
#else
#define MORPHRAY_CPU_SINGLE_RAY_SINGLE_RAYS_INL_H
#endif

#include <bit>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "common/bvh/bvh.h"
#include "cpu/single_ray/closest_leaf-inl.h"
#include "cpu/single_ray/node_lanes-inl.h"
#include "cpu/single_ray/ray_stream-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {
using namespace simd::HWY_NAMESPACE;

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

/// Batcher's network for eight numbers.
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

    /// There is room. The same ray may be added several times.
    HWY_INLINE void add(std::uint32_t ray, std::uint32_t child) {
        assert(count_ < kMost);
        paths_[count_].size = 1;
        paths_[count_].ray = ray;
        paths_[count_].key[0] = 0;
        paths_[count_++].child[0] = child;
    }

    /// Finds the closest hits of all that were added, and removes them.
    HWY_INLINE void intersect(const Bvh& bvh, const RayStream& stream, ClosestHits& closest) {
        std::uint8_t left[kMost];
        std::size_t count = std::exchange(count_, 0);
        for (std::size_t i = 0; i < count; ++i) left[i] = static_cast<std::uint8_t>(i);
        while (count > 0) {
            Steps nodes, leaves;
            for (std::size_t k = 0; k < count; ++k) {
                Path& path = paths_[left[k]];
                const std::size_t top = --path.size;
                const auto t_least = std::bit_cast<float>(path.key[top] & ~kSlotBits);
                const bool reached = t_least <= closest.last[path.ray];
                const bool is_leaf = (path.child[top] & kLeafBit) != 0;
                nodes.add(reached && !is_leaf, left[k], path.child[top]);
                leaves.add(reached && is_leaf, left[k], path.child[top] & ~kLeafBit);
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
        std::uint32_t key[kMaxStack + 8];
        std::uint32_t child[kMaxStack + 8];
        std::uint32_t ray;
        std::uint32_t size;
    };

    /// The paths at a node, or at a leaf.
    struct Steps {
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
            hn::TableLookupLanes(load_unaligned(node.child), hn::IndicesFromVec(kUints, places));
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
        HWY_ALIGN float t_least[kWidth];
        for (std::size_t v = 0; v < kVectors; ++v) store(least[v], t_least + v * kLanes);
        std::size_t size = 0;
        for (std::uint32_t slots = met; slots != 0; slots &= slots - 1) {
            const auto slot = static_cast<std::uint32_t>(std::countr_zero(slots));
            const std::uint32_t k =
                (std::bit_cast<std::uint32_t>(t_least[slot]) & ~kSlotBits) | slot;
            std::size_t place = size++;
            for (; place > 0 && key[place - 1] < k; --place) {
                key[place] = key[place - 1];
                child[place] = child[place - 1];
            }
            key[place] = k;
            child[place] = node.child[slot];
        }
    }

    std::size_t count_ = 0;
    Path paths_[kMost];
};

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif  // per target
