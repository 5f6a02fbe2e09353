// The hits of an earlier pass.
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
