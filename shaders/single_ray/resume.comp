// Runs a round of the suspended rays. Each continues its traversal, whose stack is kept in memory
// between rounds. The answer is that of one long traversal, and dispatches are short.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/kernel.glsl"
#include "shaders/single_ray/traverse.glsl"

layout(push_constant) uniform Arguments { ResumeArguments args; };
layout(std430, binding = kBindHits) writeonly buffer Hits { Hit hits[]; };
layout(std430, binding = kBindOcclusion) buffer Occlusion { uint occlusion[]; };
// Field f of slot i is states[f * args.count + i].
layout(std430, binding = kBindStates) buffer States { uint states[]; };

uint load_field(uint slot, uint field) { return states[field * args.count + slot]; }
void save_field(uint slot, uint field, uint value) { states[field * args.count + slot] = value; }

Traversal load_traversal(uint slot, Ray ray) {
    Traversal t = begin_traversal(ray);
    t.current = load_field(slot, kStateCurrent);
    t.stack_size = load_field(slot, kStateStackSize);
    t.best_prim = load_field(slot, kStateBestPrim);
    t.best.t = uintBitsToFloat(load_field(slot, kStateBestT));
    t.best.u = uintBitsToFloat(load_field(slot, kStateBestU));
    t.best.v = uintBitsToFloat(load_field(slot, kStateBestV));
    for (uint i = 0u; i < t.stack_size; ++i) {
        stack[i].x = load_field(slot, kStateStack + 2u * i);
        stack[i].y = load_field(slot, kStateStack + 2u * i + 1u);
    }
    return t;
}

void save_traversal(uint slot, Traversal t) {
    save_field(slot, kStateCurrent, t.current);
    save_field(slot, kStateStackSize, t.stack_size);
    save_field(slot, kStateBestPrim, t.best_prim);
    save_field(slot, kStateBestT, floatBitsToUint(t.best.t));
    save_field(slot, kStateBestU, floatBitsToUint(t.best.u));
    save_field(slot, kStateBestV, floatBitsToUint(t.best.v));
    for (uint i = 0u; i < t.stack_size; ++i) {
        save_field(slot, kStateStack + 2u * i, stack[i].x);
        save_field(slot, kStateStack + 2u * i + 1u, stack[i].y);
    }
}

void main() {
    uint slot = gl_GlobalInvocationID.x;
    if (slot >= args.count) return;
    Ray ray = work.suspended[args.first + slot].ray;
    Traversal t = begin_traversal(ray);
    if (args.fresh == 0u) t = load_traversal(slot, ray);
    if (finished(t)) return;
    traverse(t, ray, args.any_hit != 0u);
    save_traversal(slot, t);
    report(t.status);
    if (!finished(t)) {
        atomicAdd(work.header.unfinished_count, 1u);
        return;
    }
    uint index = work.suspended[args.first + slot].answer_index;
    if (args.any_hit == 0u) {
        hits[index] = closest_hit(t);
    } else if (t.best_prim != kNoPrim) {
        // Several rays of a pixel may end at the same time.
        atomicAdd(occlusion[index], 1u);
    }
}
