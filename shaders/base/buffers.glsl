// Buffers that kernels read, in two bodies. Lavapipe reads texels three times as fast as storage
// buffers, and storage texels in place, but uniform ones by a call. A GPU reads storage buffers as
// fast, and these hold more than 2^27 texels.
//
//   READ4, READ4_IN_PLACE   declare a buffer of uvec4, READ1 one of uint
//   AT4, AT4_IN_PLACE, AT1  read element i of it
#ifndef SHADERS_BASE_BUFFERS_GLSL
#define SHADERS_BASE_BUFFERS_GLSL

#ifdef STORAGE_BUFFERS
#define READ4(Block, name, number) \
    layout(std430, binding = number) readonly buffer Block { uvec4 name[]; }
#define READ1(Block, name, number) \
    layout(std430, binding = number) readonly buffer Block { uint name[]; }
#define READ4_IN_PLACE(Block, name, number) READ4(Block, name, number)
#define AT4(name, i) name[i]
#define AT1(name, i) name[i]
#define AT4_IN_PLACE(name, i) name[i]
#else
#define READ4(Block, name, number) layout(binding = number) uniform usamplerBuffer name
#define READ1(Block, name, number) READ4(Block, name, number)
#define READ4_IN_PLACE(Block, name, number) \
    layout(binding = number, rgba32ui) uniform readonly uimageBuffer name
#define AT4(name, i) texelFetch(name, int(i))
#define AT1(name, i) texelFetch(name, int(i)).x
#define AT4_IN_PLACE(name, i) imageLoad(name, int(i))
#endif

#endif  // SHADERS_BASE_BUFFERS_GLSL
