// The hits of an earlier pass.
#ifndef SHADERS_BASE_FOUND_HITS_GLSL
#define SHADERS_BASE_FOUND_HITS_GLSL

#include "shaders/base/buffers.glsl"
#include "shaders/kernel_interface.h"

READ4(FoundHits, found_hits, kBindFoundHits);

Hit found_hit(uint index) {
    uvec4 words = AT4(found_hits, index);
    Hit hit;
    hit.t = uintBitsToFloat(words.x);
    hit.u = uintBitsToFloat(words.y);
    hit.v = uintBitsToFloat(words.z);
    hit.prim_id = words.w;
    return hit;
}

#endif  // SHADERS_BASE_FOUND_HITS_GLSL
