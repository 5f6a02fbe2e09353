// The hits of an earlier pass, as texels: some devices load structures from storage buffers lane by
// lane, but texels at once.
#ifndef SHADERS_BASE_FOUND_HITS_GLSL
#define SHADERS_BASE_FOUND_HITS_GLSL

#include "shaders/kernel_interface.h"

layout(binding = kBindFoundHits) uniform usamplerBuffer found_hits;

Hit found_hit(uint index) {
    uvec4 words = texelFetch(found_hits, int(index));
    Hit hit;
    hit.t = uintBitsToFloat(words.x);
    hit.u = uintBitsToFloat(words.y);
    hit.v = uintBitsToFloat(words.z);
    hit.prim_id = words.w;
    return hit;
}

#endif  // SHADERS_BASE_FOUND_HITS_GLSL
