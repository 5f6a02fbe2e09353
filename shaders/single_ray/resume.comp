// Runs a round of the suspended rays. Each continues its traversal, whose stack is kept in memory
// between rounds. The answer is that of one long traversal, and dispatches are short.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/kernel.glsl"

layout(push_constant) uniform Arguments { ResumeArguments args; };
#define RESUMES
#include "shaders/single_ray/visits.glsl"

layout(std430, binding = kBindHits) writeonly buffer Hits { Hit hits[]; };
layout(std430, binding = kBindOcclusion) buffer Occlusion { uint occlusion[]; };

void main() {
    uint slot = gl_GlobalInvocationID.x;
    if (slot >= args.count) return;
    begin_ray(work.suspended[args.first + slot].ray, args.any_hit != 0u);
    if (args.fresh == 0u) load_state(slot);
    if (finished()) return;
    traverse();
    save_state(slot);
    if (!finished()) {
        atomicAdd(work.header.unfinished_count, 1u);
        return;
    }
    uint index = work.suspended[args.first + slot].answer_index;
    if (args.any_hit == 0u) {
        hits[index] = closest_hit();
    } else if (has_hit()) {
        // Several rays of a pixel may end at the same time.
        atomicAdd(occlusion[index], 1u);
    }
}
