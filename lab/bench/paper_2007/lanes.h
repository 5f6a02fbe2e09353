// Sixteen floats as one value: GNU vector types, which the compiler maps to what the machine has.
#pragma once

#include <cstdint>
#ifdef __AVX512F__
#include <immintrin.h>
#endif

namespace mray::bench::paper_2007 {

inline constexpr int kLanes = 16;
using Floats __attribute__((vector_size(64))) = float;
/// Also masks: all bits of a lane are set, or none.
using Ints __attribute__((vector_size(64))) = std::int32_t;

// Both take b where a is NaN.
#ifdef __AVX512F__
inline Floats min(const Floats& a, const Floats& b) { return _mm512_min_ps(a, b); }
inline Floats max(const Floats& a, const Floats& b) { return _mm512_max_ps(a, b); }
inline bool any(const Ints& mask) {
    const __m512i bits = reinterpret_cast<__m512i>(mask);
    return _mm512_test_epi32_mask(bits, bits) != 0;
}
#else
inline Floats min(const Floats& a, const Floats& b) { return a < b ? a : b; }
inline Floats max(const Floats& a, const Floats& b) { return a > b ? a : b; }
inline bool any(const Ints& mask) {
    std::int32_t bits = 0;
    for (int i = 0; i < kLanes; ++i) bits |= mask[i];
    return bits != 0;
}
#endif

}  // namespace mray::bench::paper_2007
