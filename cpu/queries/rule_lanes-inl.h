// The rules of points (common/interop) on vectors, in namespace `lanes` as in
// cpu/simd/lanes-inl.h: each lane has a triangle of its own.
#if defined(MORPHRAY_CPU_QUERIES_RULE_LANES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_QUERIES_RULE_LANES_INL_H
#undef MORPHRAY_CPU_QUERIES_RULE_LANES_INL_H
#else
#define MORPHRAY_CPU_QUERIES_RULE_LANES_INL_H
#endif

#include "common/interop/closest_rule.h"
#include "common/interop/winding_rule.h"
#include "cpu/simd/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {
using namespace simd::HWY_NAMESPACE;

namespace lanes {

#define SHARED_LANES
#pragma push_macro("SHARED")
#pragma push_macro("SHARED_BEGIN")
#pragma push_macro("SHARED_END")
#undef SHARED
#undef SHARED_BEGIN
#undef SHARED_END
#define SHARED HWY_INLINE
#define SHARED_BEGIN
#define SHARED_END
#include "common/interop/closest_rule.h"
#include "common/interop/winding_rule.h"
#pragma pop_macro("SHARED")
#pragma pop_macro("SHARED_BEGIN")
#pragma pop_macro("SHARED_END")
#undef SHARED_LANES

}  // namespace lanes

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif  // per target
