// Calls code that is written once with Highway for a chosen target. Such code has
//
//   x-inl.h  functions in HWY_NAMESPACE, compiled once for each target; SIMD types stay in there,
//            and the entry points take whole batches, tiles or sets
//   x.cpp    HWY_TARGET_INCLUDE, <hwy/foreach_target.h>, <hwy/highway.h>, x-inl.h, and then, under
//            HWY_ONCE, HWY_EXPORT(function), which makes a table of the function for all targets,
//            and SIMD_FUNCTION(function, target)
//   x.h      functions that take a SimdTarget, or a class that is made for one and keeps the
//            function pointers
//
// Types in the signature of an exported function are declared outside of HWY_NAMESPACE.
// cpu/queries/tree_queries.* is the example. common/CMakeLists.txt (morphray_simd) decides which
// targets are compiled, the same for every user of Highway.
#pragma once

#include <hwy/targets.h>

#include <bit>
#include <cassert>
#include <cstddef>

#include "common/simd/simd_target.h"

namespace mray {

/// Returns the entry of a target in a table of HWY_EXPORT. Entry 0 dispatches by itself and is not
/// used here; then come the SIMD targets from the best on, last the one without SIMD. A program
/// that is compiled for one target has a table of one.
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
