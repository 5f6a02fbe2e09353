#include "cpu/image/pixel_shader.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "cpu/image/pixel_shader.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "cpu/image/pixel_shader-inl.h"

#if HWY_ONCE

#include "common/simd/simd_dispatch-inl.h"

namespace mray::cpu {
namespace {

HWY_EXPORT(shade_camera_part);
HWY_EXPORT(make_camera_rays_of_tile);
HWY_EXPORT(make_shadow_rays_of_part);
HWY_EXPORT(shade_shadows_of_part);
HWY_EXPORT(make_ao_rays_of_part);
HWY_EXPORT(shade_ao_of_part);

}  // namespace

PixelShader::PixelShader(SimdTarget target)
    : make_camera_rays(SIMD_FUNCTION(make_camera_rays_of_tile, target)),
      shade_camera(SIMD_FUNCTION(shade_camera_part, target)),
      make_shadow_rays(SIMD_FUNCTION(make_shadow_rays_of_part, target)),
      shade_shadows(SIMD_FUNCTION(shade_shadows_of_part, target)),
      make_ao_rays(SIMD_FUNCTION(make_ao_rays_of_part, target)),
      shade_ao(SIMD_FUNCTION(shade_ao_of_part, target)) {}

}  // namespace mray::cpu

#endif  // HWY_ONCE
