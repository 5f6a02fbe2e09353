// Closest hits of a stream of up to 64 rays of one octant.
//
// The rays of a stream go down the tree together, front to back (cpu/single_ray/walks-inl.h). A
// leaf's triangles are tested with rays for lanes (cpu/single_ray/closest_leaf-inl.h). Of diffuse
// rays few lanes of each vector meet a leaf; packed, they fill some vectors, and the leaf is
// projected for these alone (lab/notes/cpu_tracer.md has the figures). Where few rays are left they
// go on alone, up to 64 of them in turn (cpu/single_ray/single_rays-inl.h).
#if defined(MORPHRAY_CPU_SINGLE_RAY_STREAM_CLOSEST_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_SINGLE_RAY_STREAM_CLOSEST_INL_H
#undef MORPHRAY_CPU_SINGLE_RAY_STREAM_CLOSEST_INL_H
#else
#define MORPHRAY_CPU_SINGLE_RAY_STREAM_CLOSEST_INL_H
#endif

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>

#include "common/bvh/bvh.h"
#include "cpu/single_ray/closest_leaf-inl.h"
#include "cpu/single_ray/ray_stream-inl.h"
#include "cpu/single_ray/single_rays-inl.h"
#include "cpu/single_ray/walks-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {
using namespace simd::HWY_NAMESPACE;

// Other targets compress vectors by a table, or not at all.
inline constexpr bool kPacksRays = HWY_TARGET <= HWY_AVX3 && HWY_ARCH_X86;

class PackedRays {
public:
    /// Whether these rays (bits) are of several vectors and fill half of them or less, and half a
    /// stream.
    HWY_INLINE static bool is_worth_packing(std::uint64_t rays) {
        const auto count = static_cast<std::size_t>(std::popcount(rays));
        if (!kPacksRays || 2 * count > kStreamRays) return false;
        std::size_t vectors = 0;
        for (std::size_t first = 0; first < kStreamRays; first += kLanes)
            vectors += (rays >> first & kLaneBits) != 0;
        return vectors > 1 && 2 * count <= kLanes * vectors;
    }

    /// Takes these rays (bits) of a stream, with what a leaf asks of them.
    HWY_INLINE void pack(const RayStream& stream, const ClosestHits& hits, std::uint64_t rays) {
        count_ = 0;
        for (std::size_t first = 0; first < kStreamRays; first += kLanes) {
            const auto some = static_cast<std::uint32_t>(rays >> first & kLaneBits);
            if (some != 0) pack_vector(stream, hits, first, some);
        }
    }

    std::size_t count() const { return count_; }
    /// The number of a packed ray in its stream.
    std::size_t operator[](std::size_t i) const { return ray_[i]; }

    /// The closest hits of the packed rays from `first` on in a leaf, to those of the stream.
    HWY_INLINE void intersect(std::size_t first, const Leaf& leaf, ClosestHits& hits) {
        const std::size_t size = std::min<std::size_t>(kLanes, count_ - first);
        const auto asked = static_cast<std::uint32_t>((std::uint64_t{1} << size) - 1);
        const UintVec old_id = load(closest_.prim_id + first);
        const FloatVec old_t = load(closest_.t + first);
        intersect_leaf_together(stream_, first, asked, leaf, closest_);
        const Mask same = (load(closest_.t + first) == old_t) &
                          float_mask(load(closest_.prim_id + first) == old_id);
        for (std::uint32_t left = bits_of(!same) & asked; left != 0; left &= left - 1) {
            const std::size_t i = first + static_cast<std::size_t>(std::countr_zero(left));
            const std::uint32_t ray = ray_[i];
            hits.t[ray] = closest_.t[i];
            hits.last[ray] = closest_.last[i];
            hits.u[ray] = closest_.u[i];
            hits.v[ray] = closest_.v[i];
            hits.prim_id[ray] = closest_.prim_id[i];
        }
    }

private:
    /// Appends the rays `some` (bits, from `first` on). Whole vectors are written beyond them.
    HWY_INLINE void pack_vector(const RayStream& stream, const ClosestHits& hits, std::size_t first,
                                std::uint32_t some) {
        const UintMask which = uint_mask(mask_of(some));
        const auto append = [&](UintVec values, std::uint32_t* to)
                                HWY_ATTR { store_unaligned(hn::Compress(values, which), to); };
        const auto copy = [&](const float* from, float* to) HWY_ATTR {
            const FloatVec values = load(from + first);
            store_unaligned(hn::Compress(values, float_mask(which)), to + count_);
        };
        for (int k = 0; k < 3; ++k) {
            copy(stream.sheared_org[k], stream_.sheared_org[k]);
            copy(stream.sheared_dir[k], stream_.sheared_dir[k]);
        }
        copy(stream.depth_slack, stream_.depth_slack);
        copy(stream.tnear, stream_.tnear);
        copy(hits.t, closest_.t);
        append(load(stream.axis + first), stream_.axis + count_);
        append(load(hits.prim_id + first), closest_.prim_id + count_);
        append(hn::Iota(kUints, static_cast<std::uint32_t>(first)), ray_ + count_);
        count_ += static_cast<std::size_t>(std::popcount(some));
    }

    // At most half of the entries are in use, so that there is room for whole vectors.
    RayStream stream_;
    ClosestHits closest_;
    std::uint32_t ray_[kStreamRays];
    std::size_t count_;
};

// Rays go on together below a node if they are more than this many (lab/notes/cpu_tracer.md has
// the figures).
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

    /// Sets hits[order[i]].
    HWY_INLINE void intersect(Hit* hits) {
        const std::size_t count = order_.size();
        if (count > together_) {
            walk_together(bvh_, stream_, count, *this);
            single_rays_.intersect(bvh_, stream_, closest_);
        } else if (count >= kFewRays) {
            for (std::uint32_t i = 0; i < count; ++i) single_rays_.add(i, 0);
            single_rays_.intersect(bvh_, stream_, closest_);
        } else {
            for (std::size_t i = 0; i < count; ++i) intersect_ray(bvh_, stream_, i, closest_);
        }
        for (std::size_t i = 0; i < count; ++i) hits[order_[i]] = closest_.hit(i);
    }

    // For walk_together().
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
    HWY_INLINE void part(std::uint64_t rays, std::uint32_t child) {
        if (!single_rays_.has_room_for(kTogetherAtNode))
            single_rays_.intersect(bvh_, stream_, closest_);
        for (; rays != 0; rays &= rays - 1)
            single_rays_.add(static_cast<std::uint32_t>(std::countr_zero(rays)), child);
    }
    HWY_INLINE void visit_leaf(std::uint64_t rays, const Leaf& leaf) {
        if (static_cast<std::size_t>(std::popcount(rays)) > kTogetherInLeaf &&
            PackedRays::is_worth_packing(rays)) {
            return visit_leaf_packed(rays, leaf);
        }
        for_rays_of_leaf(
            rays,
            [&](std::size_t first, std::uint32_t asked)
                HWY_ATTR { intersect_leaf_together(stream_, first, asked, leaf, closest_); },
            [&](std::size_t ray) HWY_ATTR { intersect_leaf_alone(stream_, ray, leaf, closest_); });
    }

private:
    HWY_INLINE void visit_leaf_packed(std::uint64_t rays, const Leaf& leaf) {
        packed_.pack(stream_, closest_, rays);
        std::size_t first = 0;
        for (; first + kTogetherInLeaf < packed_.count(); first += kLanes)
            packed_.intersect(first, leaf, closest_);
        for (; first < packed_.count(); ++first)
            intersect_leaf_alone(stream_, packed_[first], leaf, closest_);
    }

    const Bvh& bvh_;
    std::span<const std::uint16_t> order_;
    std::size_t together_;
    RayStream stream_;
    ClosestHits closest_;
    PackedRays packed_;
    SingleRays single_rays_;
};

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif  // per target
