// A stream of rays in their order, per target.
#if defined(MORPHRAY_TESTS_CPU_SINGLE_RAY_STREAM_OF_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_TESTS_CPU_SINGLE_RAY_STREAM_OF_INL_H
#undef MORPHRAY_TESTS_CPU_SINGLE_RAY_STREAM_OF_INL_H
#else
#define MORPHRAY_TESTS_CPU_SINGLE_RAY_STREAM_OF_INL_H
#endif

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "cpu/single_ray/ray_stream-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {

/// The stream of all rays in their order.
inline RayStream stream_of(std::span<const Ray> rays) {
    std::vector<std::uint16_t> order(rays.size());
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = static_cast<std::uint16_t>(i);
    return make_stream(rays.data(), order);
}

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif  // per target
