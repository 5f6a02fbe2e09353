// Equality in every bit: -0 differs from 0, and a NaN equals itself.
#pragma once

#include <algorithm>
#include <cstring>
#include <span>

#include "common/interop/ray.h"

namespace mray::test {

/// Of types without padding.
template <class Value>
bool same_bits(const Value& a, const Value& b) {
    return std::memcmp(&a, &b, sizeof a) == 0;
}

/// The same for the elements of two contiguous containers, and their number.
template <class Values>
bool same_bytes(const Values& a, const Values& b) {
    return std::ranges::equal(std::as_bytes(std::span(a)), std::as_bytes(std::span(b)));
}

}  // namespace mray::test
