// Equality of hits in every bit: -0 differs from 0, and a NaN equals itself.
#pragma once

#include <cstring>

#include "common/interop/ray.h"

namespace mray::test {

inline bool same_bits(const Hit& a, const Hit& b) { return std::memcmp(&a, &b, sizeof a) == 0; }

}  // namespace mray::test
