// Decides the triangles that the fast path of the rule left open, one ray a lane. The whole rule takes
// many registers, which the kernels that traverse the tree can do without.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/kernel.glsl"
#include "shaders/tree.glsl"

layout(push_constant) uniform Arguments { DecideArguments args; };
layout(std430, binding = kBindWork) buffer Work {
    WorkHeader header;
    Suspended suspended[];
} work;
layout(std430, binding = kBindHits) buffer Hits { Hit hits[]; };
layout(std430, binding = kBindOcclusion) buffer Occlusion { uint occlusion[]; };

void main() {
    if (gl_GlobalInvocationID.x >= work.header.open_count) return;
    uint record = uint(work.suspended.length()) - 1u - gl_GlobalInvocationID.x;
    Ray ray = work.suspended[record].ray;
    uint index = work.suspended[record].answer_index;
    ShearedRay sheared = shear_ray(ray.org, ray.dir);
    uvec4 answer = uvec4(floatBitsToUint(ray.tfar), 0u, 0u, kNoPrim);
    if (args.any_hit == 0u && hits[index].prim_id != kNoPrim) {
        answer = uvec4(floatBitsToUint(hits[index].t), floatBitsToUint(hits[index].u),
                       floatBitsToUint(hits[index].v), hits[index].prim_id);
    }
    for (uint k = 0u; k < kMostOpen; ++k) {
        uint open = work.suspended[record].open[k];
        if (open == kNoOpen || (args.any_hit != 0u && answer.w != kNoPrim)) break;
        decide_triangle(sheared, ray.tnear, open / kLeafTriangles, open % kLeafTriangles, answer);
    }
    if (answer.w == kNoPrim) return;
    if (args.any_hit == 0u) {
        hits[index] = hit_from(answer);
    } else {
        // Several rays of a pixel may end at the same time.
        atomicAdd(occlusion[index], 1u);
    }
}
