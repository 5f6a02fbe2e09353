// Points near each other, one in each lane.
#if defined(MORPHRAY_CPU_QUERIES_POINT_LANES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_QUERIES_POINT_LANES_INL_H
#undef MORPHRAY_CPU_QUERIES_POINT_LANES_INL_H
#else
#define MORPHRAY_CPU_QUERIES_POINT_LANES_INL_H
#endif

#include <algorithm>
#include <cstddef>
#include <span>

#include "common/simd/vectors-inl.h"
#include "cpu/simd/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {
using namespace simd::HWY_NAMESPACE;

#if HWY_TARGET != HWY_SCALAR

/// At most kLanes points, and the corners of their box in all lanes. Lanes without a point have the
/// last one.
struct PointLanes {
    lanes::Float3 p;
    lanes::Float3 lower;
    lanes::Float3 upper;

    HWY_INLINE explicit PointLanes(std::span<const vec3> points) {
        HWY_ALIGN float values[3][kLanes];
        for (std::size_t i = 0; i < kLanes; ++i) {
            const vec3& point = points[std::min(i, points.size() - 1)];
            for (int axis = 0; axis < 3; ++axis) values[axis][i] = point[axis];
        }
        p = {load(values[0]), load(values[1]), load(values[2])};
        lower = {hn::MinOfLanes(kFloats, p.x), hn::MinOfLanes(kFloats, p.y),
                 hn::MinOfLanes(kFloats, p.z)};
        upper = {hn::MaxOfLanes(kFloats, p.x), hn::MaxOfLanes(kFloats, p.y),
                 hn::MaxOfLanes(kFloats, p.z)};
    }
};

#endif  // HWY_TARGET

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif  // per target
