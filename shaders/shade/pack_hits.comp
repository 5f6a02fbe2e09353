// Copies the words of hits that a caller needs to memory of the host, so that no others travel. t of a
// miss is infinite there, since its triangle may not be among them.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/kernel.glsl"

layout(push_constant) uniform Arguments { PackArguments args; };
READ4(FoundHits, found_hits, kBindFoundHits);
layout(std430, binding = kBindPackedHits) writeonly buffer PackedHits { uint packed_hits[]; };

void main() {
    uint index = gl_GlobalInvocationID.x;
    if (index >= args.count) return;
    uvec4 hit = AT4(found_hits, index);
    if (hit.w == kNoPrim) hit.x = 0x7F800000u;
    uint to = index * uint(bitCount(args.words));
    for (uint k = 0u; k < 4u; ++k) {
        if ((args.words >> k & 1u) != 0u) packed_hits[to++] = hit[k];
    }
}
