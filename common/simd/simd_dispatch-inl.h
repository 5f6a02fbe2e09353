// Calls code that is written once with Highway for a chosen target; cpu/queries/tree_queries.* is
// the example:
//
//   x-inl.h  functions in HWY_NAMESPACE, compiled once for each target; SIMD types stay in there,
//            and the entry points take whole batches, tiles or sets of types declared outside
//   x.cpp    HWY_TARGET_INCLUDE, <hwy/foreach_target.h>, <hwy/highway.h>, x-inl.h, and then, under
//            HWY_ONCE, HWY_EXPORT(function), which makes a table of the function for all targets,
//            and SIMD_FUNCTION(function, target)
//   x.h      functions that take a SimdTarget, or a class that keeps the function pointers of one
#pragma once

#include <hwy/targets.h>

#include <bit>
#include <cassert>
#include <cstddef>

#include "common/simd/simd_target.h"

namespace mray {

/// The entry of a target in a table of HWY_EXPORT: after the first, which dispatches by itself,
/// come SIMD targets from the best on, last the one without SIMD; for one target a table of one.
template <class Function, std::size_t N>
Function simd_function(const Function (&table)[N], const SimdTarget& target) {
    if constexpr (N == 1) return table[0];
    const auto simd = static_cast<std::uint64_t>(HWY_CHOSEN_TARGET_SHIFT(target.bit));
    const auto entry = simd == 0 ? N - 1 : static_cast<std::size_t>(std::countr_zero(simd));
    assert(entry < N && table[entry] != nullptr);
    return table[entry];
}

}  // namespace mray

#define SIMD_FUNCTION(function, target) ::mray::simd_function(HWY_DISPATCH_TABLE(function), target)
