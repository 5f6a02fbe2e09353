// The processor's flags of floating-point exceptions.
#pragma once

#ifdef __SSE__
#include <xmmintrin.h>
#else
#include <cfenv>
#endif

namespace mray::test {

#ifdef __SSE__
inline void clear_float_flags() { _mm_setcsr(_mm_getcsr() & ~0x3Fu); }
/// Whether an operation since then raised any flag but inexact: x86 also has one for operands that
/// are denormal.
inline bool raised_more_than_inexact() { return (_mm_getcsr() & 0x1Fu) != 0; }
#else
inline void clear_float_flags() { std::feclearexcept(FE_ALL_EXCEPT); }
inline bool raised_more_than_inexact() {
    return std::fetestexcept(FE_ALL_EXCEPT & ~FE_INEXACT) != 0;
}
#endif

}  // namespace mray::test
