#include "cpu/image/lit_shader.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "cpu/image/lit_shader.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "cpu/image/lit_shader-inl.h"

#if HWY_ONCE

#include "common/simd/simd_dispatch-inl.h"

namespace mray::cpu {
namespace {

HWY_EXPORT(find_flat_shadows_of_row);
HWY_EXPORT(shade_lit_rows);

}  // namespace

LitShader::LitShader(SimdTarget target)
    : shade_rows(SIMD_FUNCTION(shade_lit_rows, target)),
      find_flat_shadows(SIMD_FUNCTION(find_flat_shadows_of_row, target)) {}

}  // namespace mray::cpu

#endif  // HWY_ONCE
