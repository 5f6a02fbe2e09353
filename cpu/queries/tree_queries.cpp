#include "cpu/queries/tree_queries.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "cpu/queries/tree_queries.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "cpu/queries/tree_queries-inl.h"

#if HWY_ONCE

#include "common/simd/simd_dispatch-inl.h"

namespace mray::cpu {
namespace {

HWY_EXPORT(answer_batch);

}  // namespace

TreeQueries::TreeQueries(const Bvh& bvh, SimdTarget target)
    : bvh_(&bvh), answer_(SIMD_FUNCTION(answer_batch, target)) {}

}  // namespace mray::cpu

#endif  // HWY_ONCE
