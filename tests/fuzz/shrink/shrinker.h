// Makes a failing case small.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>

#include "tests/fuzz/case/fuzz_case.h"

namespace morphray::fuzz {

/// Where a case fails: a pixel, or one of its rays.
struct FailurePlace {
    std::uint32_t x = 0;
    std::uint32_t y = 0;
    std::size_t ray = 0;
};

/// Where a case fails first; nothing if it does not, or cannot be traced.
using Fails = std::function<std::optional<FailurePlace>(const FuzzCase&)>;

/// A case that fails and from which none of the following can be taken: a kind of comparison, a
/// pose, a triangle, a vertex, a ray, pixels, digits of a number. Ends early after `trials` calls
/// of `fails`.
FuzzCase shrink(const FuzzCase& failing, const Fails& fails, std::size_t trials = 3000);

}  // namespace morphray::fuzz
