// Shrinks a failing case.
#pragma once

#include <cstddef>
#include <functional>

#include "tests/fuzz/case/fuzz_case.h"

namespace mray::fuzz {

/// Whether a case fails in the way that is looked for.
using Fails = std::function<bool(const FuzzCase&)>;

/// Returns a failing case that has lost what it can lose: its image, poses, triangles, unused
/// vertices, rays, points, rays of pixels, and pixels. Ends early after
/// `trials` calls of `fails`.
FuzzCase shrink(const FuzzCase& failing, const Fails& fails, std::size_t trials = 3000);

}  // namespace mray::fuzz
