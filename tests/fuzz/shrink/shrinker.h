// Shrinks a failing case.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>

#include "tests/fuzz/case/fuzz_case.h"

namespace mray::fuzz {

/// The place where a case fails: a pixel, or one of its rays or points.
struct FailurePlace {
    std::uint32_t x = 0;
    std::uint32_t y = 0;
    std::size_t ray = 0;
    std::size_t point = 0;
};

/// Returns the first place where a case fails; nothing if it does not fail or cannot be traced.
using Fails = std::function<std::optional<FailurePlace>(const FuzzCase&)>;

/// Returns a failing case from which no kind of comparison, pose, triangle, vertex, ray, point,
/// pixels or digits of a number can be removed. Ends early after `trials` calls of `fails`.
FuzzCase shrink(const FuzzCase& failing, const Fails& fails, std::size_t trials = 3000);

}  // namespace mray::fuzz
