// The first include of every kernel: exact arithmetic, buffers, and the lanes of a workgroup.
#ifndef SHADERS_KERNEL_GLSL
#define SHADERS_KERNEL_GLSL

#extension GL_EXT_control_flow_attributes : require
#extension GL_EXT_spirv_intrinsics : require

// The modes that make + - * on floats round equally on every device (Vulkan specification,
// "Precision and Operation of SPIR-V Instructions"): 4462 is RoundingModeRTE, 4461
// SignedZeroInfNanPreserve, each for 32 bits; 4467 and 4466 are their capabilities. The host removes
// all of them for a device that does not promise them (without_float_modes()).
spirv_execution_mode(extensions = ["SPV_KHR_float_controls"], capabilities = [4467], 4462, 32);
spirv_execution_mode(extensions = ["SPV_KHR_float_controls"], capabilities = [4466], 4461, 32);

#include "shaders/kernel_interface.h"

layout(local_size_x = kGroupSize) in;

// Buffers that kernels read. Lavapipe reads texels three times as fast as storage buffers, and storage
// texels in place; a GPU reads storage buffers as fast, which may have more than 2^27 elements.
//   READ4, READ4_IN_PLACE, READ3, READ1   declare a buffer of uvec4, uvec3 or uint
//   AT4, AT4_IN_PLACE, AT3, AT1           read element i of it
//   WORDS, WORD_AT, STORE_WORD            a buffer of floats that the refit reads and writes
#ifdef STORAGE_BUFFERS
#define READ4(Block, name, number) \
    layout(std430, binding = number) readonly buffer Block { uvec4 name[]; }
#define READ1(Block, name, number) \
    layout(std430, binding = number) readonly buffer Block { uint name[]; }
#define WORDS(Block, name, number) layout(std430, binding = number) buffer Block { uint name[]; }
#define WORD_AT(name, i) uintBitsToFloat(name[i])
#define STORE_WORD(name, i, value) name[i] = floatBitsToUint(value)
#define READ4_IN_PLACE(Block, name, number) READ4(Block, name, number)
#define READ3(Block, name, number) READ1(Block, name, number)
#define AT4(name, i) name[i]
#define AT1(name, i) name[i]
#define AT4_IN_PLACE(name, i) name[i]
#define AT3(name, i) uvec3(name[3u * (i)], name[3u * (i) + 1u], name[3u * (i) + 2u])
#else
#define READ4(Block, name, number) layout(binding = number) uniform usamplerBuffer name
#define READ1(Block, name, number) READ4(Block, name, number)
#define WORDS(Block, name, number) layout(binding = number, r32ui) uniform uimageBuffer name
#define WORD_AT(name, i) uintBitsToFloat(imageLoad(name, int(i)).x)
#define STORE_WORD(name, i, value) imageStore(name, int(i), uvec4(floatBitsToUint(value)))
#define READ4_IN_PLACE(Block, name, number) \
    layout(binding = number, rgba32ui) uniform readonly uimageBuffer name
#define READ3(Block, name, number) READ4(Block, name, number)
#define AT4(name, i) texelFetch(name, int(i))
#define AT1(name, i) texelFetch(name, int(i)).x
#define AT4_IN_PLACE(name, i) imageLoad(name, int(i))
#define AT3(name, i) texelFetch(name, int(i)).xyz
#endif

Ray ray_from(uvec4 first, uvec4 second) {
    vec4 start = uintBitsToFloat(first);
    vec4 way = uintBitsToFloat(second);
    return Ray(start.xyz, start.w, way.xyz, way.w);
}

Hit hit_from(uvec4 words) {
    vec3 place = uintBitsToFloat(words.xyz);
    return Hit(place.x, place.y, place.z, words.w);
}

/// Permutes workgroups so that two neighbours go to different halves of the grid: a thread of lavapipe
/// takes a contiguous part of a dispatch, and some take longer. A. Thue's sequence chooses the half:
/// plain alternation would make columns of an image whose rows have an even number of workgroups.
uint spread_group(uint group, uint count) {
#ifdef STORAGE_BUFFERS
    return group;
#else
    uint half_count = (count + 1u) / 2u;
    bool is_second = group >= half_count;
    uint pair = is_second ? group - half_count : group;
    uint swapped = 2u * pair + 1u < count ? uint(bitCount(pair)) & 1u : 0u;
    return 2u * pair + ((is_second ? 1u : 0u) ^ swapped);
#endif
}

/// The pixel of a lane, where a workgroup is a tile of 8x8 pixels. Each power of two of lanes covers
/// a block that is as square as possible, for every width of a subgroup.
uvec2 tile_pixel(uint tile_count, uint tile_columns) {
    uint lane = gl_LocalInvocationID.x;
    uint x = (lane & 3u) | ((lane >> 1u) & 4u);
    uint y = ((lane >> 2u) & 1u) | ((lane >> 3u) & 6u);
    uint tile = spread_group(gl_WorkGroupID.x, tile_count);
    return uvec2(tile % tile_columns, tile / tile_columns) * kTileSize + uvec2(x, y);
}

#endif  // SHADERS_KERNEL_GLSL
