// Rays of a stream that meet a leaf, side by side. Of diffuse rays few lanes of each vector meet
// it; packed, they fill some vectors, and the leaf is projected for these alone
// (lab/notes/cpu_tracer.md has the figures).
#if defined(MORPHRAY_CPU_SINGLE_RAY_PACKED_RAYS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_SINGLE_RAY_PACKED_RAYS_INL_H
#undef MORPHRAY_CPU_SINGLE_RAY_PACKED_RAYS_INL_H
#else
#define MORPHRAY_CPU_SINGLE_RAY_PACKED_RAYS_INL_H
#endif

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>

#include "cpu/single_ray/closest_leaf-inl.h"
#include "cpu/single_ray/ray_stream-inl.h"

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

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif  // per target
