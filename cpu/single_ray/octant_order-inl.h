// Rays by the octants of their directions: what a stream is made of. Neighbours in a batch stay
// neighbours in a stream.
#if defined(MORPHRAY_CPU_SINGLE_RAY_OCTANT_ORDER_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_SINGLE_RAY_OCTANT_ORDER_INL_H
#undef MORPHRAY_CPU_SINGLE_RAY_OCTANT_ORDER_INL_H
#else
#define MORPHRAY_CPU_SINGLE_RAY_OCTANT_ORDER_INL_H
#endif

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>

#include "cpu/single_ray/ray_stream-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {
using namespace simd::HWY_NAMESPACE;

// Rays that are ordered together.
inline constexpr std::size_t kBatchRays = 2048;

/// The indices of at most kBatchRays rays: those of octant k are order[begin[k] .. begin[k + 1]).
struct OctantOrder {
    static constexpr std::size_t kOctants = 8;
    std::uint16_t order[kBatchRays];
    std::size_t begin[kOctants + 1];

    HWY_INLINE explicit OctantOrder(std::span<const Ray> rays) {
        std::uint8_t octants[kBatchRays];
        std::uint32_t next[kParts][kOctants] = {};
        for_each(rays.size(), [&](std::size_t part, std::size_t i) {
            octants[i] = octant_of(rays[i].dir);
            ++next[part][octants[i]];
        });
        std::uint32_t sum = 0;
        for (std::size_t octant = 0; octant < kOctants; ++octant) {
            begin[octant] = sum;
            for (auto& of_part : next) sum += std::exchange(of_part[octant], sum);
        }
        begin[kOctants] = sum;
        for_each(rays.size(), [&](std::size_t part, std::size_t i) {
            order[next[part][octants[i]]++] = static_cast<std::uint16_t>(i);
        });
    }

    /// Calls trace(order) for the streams of the rays: at most kStreamRays of one octant each.
    template <class Trace>
    HWY_INLINE void for_each_stream(Trace trace) const {
        for (std::size_t octant = 0; octant < kOctants; ++octant) {
            const std::size_t end = begin[octant + 1];
            for (std::size_t i = begin[octant]; i < end; i += kStreamRays)
                trace(std::span(order + i, std::min(kStreamRays, end - i)));
        }
    }

private:
    // Parts of the batch that rays are taken from in turn, because a counter that was just written
    // takes some cycles until it can be read.
    static constexpr std::size_t kParts = 4;

    /// As rdir has its signs: a zero counts as positive.
    HWY_INLINE static std::uint8_t octant_of(vec3 dir) {
        return static_cast<std::uint8_t>((dir.x < 0) + 2 * (dir.y < 0) + 4 * (dir.z < 0));
    }

    /// Calls visit(part, i) for each i below count, where each part has its indices in order.
    template <class Visit>
    HWY_INLINE static void for_each(std::size_t count, Visit visit) {
        const std::size_t size = count / kParts;
        for (std::size_t i = 0; i < size; ++i) {
            for (std::size_t part = 0; part < kParts; ++part) visit(part, part * size + i);
        }
        for (std::size_t i = kParts * size; i < count; ++i) visit(kParts - 1, i);
    }
};

/// Calls trace(batch, order, first) for the streams of any rays, where batch are the rays from
/// `first` on.
template <class Trace>
HWY_INLINE void for_each_stream(std::span<const Ray> rays, Trace trace) {
    for (std::size_t first = 0; first < rays.size(); first += kBatchRays) {
        const auto batch = rays.subspan(first, std::min(kBatchRays, rays.size() - first));
        const OctantOrder order(batch);
        order.for_each_stream(
            [&](std::span<const std::uint16_t> part) { trace(batch.data(), part, first); });
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif  // per target
