// A query about all triangles in some boxes, one query a lane: a walk over the shared layout
// that can stop after any step and go on later.
//
// A kernel defines, before it includes this file,
//     uvec4 answer;                                what has been found; the host reads it
//     bool meets(vec3 lower, vec3 upper, out uint key)   whether a box is to be visited, and a key
//     bool is_over(uint key)                             whether a box of this key need not be
//     uint test_triangle(vec3 a, vec3 b, vec3 c, uint prim_id)   returns steps it took besides one
// and calls answer_query(). Of the children of a node the one with the smallest key is visited first.
#extension GL_EXT_control_flow_attributes : require

#include "shaders/base/leaf.glsl"
#include "shaders/kernel_interface.h"
#include "shaders/queries/query.glsl"

layout(local_size_x = kGroupSize) in;

layout(constant_id = kConstantStepBudget) const uint kSteps = kQueryStepBudget;

READ4_IN_PLACE(Nodes, nodes, kBindNodes);
layout(std430, binding = kBindHits) buffer Answers { uvec4 answers[]; };
layout(std430, binding = kBindStates) buffer States { uint states[]; };
layout(std430, binding = kBindWork) buffer Work {
    WorkHeader header;
    uint queries[];
} work;

// The rest of the walk: the node or leaf that is next, kEmptyChild at the end; the next triangle of
// that leaf; and the boxes after it as (child, key).
uint current;
uint triangle;
uint stack_size;
uvec2 stack[kMaxStack];

void take_next() {
    triangle = 0u;
    current = kEmptyChild;
    if (stack_size == 0u) return;
    stack_size -= 1u;
    current = stack[stack_size].x;
}

/// Takes boxes that are over off the stack; returns the number.
uint skip_boxes() {
    uint steps = 0u;
    while (stack_size > 0u && is_over(stack[stack_size - 1u].y)) {
        stack_size -= 1u;
        steps += 1u;
    }
    return steps;
}

uint visit_node() {
    uint at = current * kNodeVec4s;
    uint nearest = 0xFFFFFFFFu;
    uint next = kEmptyChild;
    for (uint group = 0u; group < 4u; ++group) {
        vec4 lower_x = uintBitsToFloat(AT4_IN_PLACE(nodes, at + kNodeLowerX + group));
        vec4 upper_x = uintBitsToFloat(AT4_IN_PLACE(nodes, at + kNodeUpperX + group));
        vec4 lower_y = uintBitsToFloat(AT4_IN_PLACE(nodes, at + kNodeLowerY + group));
        vec4 upper_y = uintBitsToFloat(AT4_IN_PLACE(nodes, at + kNodeUpperY + group));
        vec4 lower_z = uintBitsToFloat(AT4_IN_PLACE(nodes, at + kNodeLowerZ + group));
        vec4 upper_z = uintBitsToFloat(AT4_IN_PLACE(nodes, at + kNodeUpperZ + group));
        uvec4 child = AT4_IN_PLACE(nodes, at + kNodeChild + group);
        for (uint i = 0u; i < 4u; ++i) {
            uint key;
            bool is_met = meets(vec3(lower_x[i], lower_y[i], lower_z[i]),
                                vec3(upper_x[i], upper_y[i], upper_z[i]), key);
            if (child[i] == kEmptyChild || !is_met) continue;
            bool is_nearer = key < nearest;
            if (next != kEmptyChild) {
                if (stack_size >= kMaxStack) {
                    atomicOr(work.header.status, kStatusStackOverflow);
                } else {
                    stack[stack_size] = is_nearer ? uvec2(next, nearest) : uvec2(child[i], key);
                    stack_size += 1u;
                }
            }
            next = is_nearer || next == kEmptyChild ? child[i] : next;
            nearest = is_nearer ? key : nearest;
        }
    }
    triangle = 0u;
    current = next;
    uint steps = 30u;
    if (next == kEmptyChild) {
        steps += skip_boxes();
        take_next();
    }
    return steps;
}

/// One triangle of the leaf.
uint visit_triangle() {
    uint at = (current & ~kLeafBit) * kLeafVec4s;
    uint count = corner_triangle_count(AT4_IN_PLACE(leaves, at).w);
    uint steps = 1u;
    if (triangle < count) {
        vec3 a;
        vec3 b;
        vec3 c;
        leaf_triangle(at, triangle, a, b, c);
        steps += test_triangle(a, b, c, leaf_prim(at, triangle));
        triangle += 1u;
    }
    if (triangle >= count) {
        steps += skip_boxes();
        take_next();
    }
    return steps;
}

void load_state(uint slot) {
    uint at = slot * kStateUints;
    current = states[at];
    stack_size = states[at + 1u];
    triangle = stack_size >> 16u;
    stack_size &= 0xFFFFu;
    answer = uvec4(states[at + 2u], states[at + 3u], states[at + 4u], states[at + 5u]);
    for (uint i = 0u; i < stack_size; ++i) {
        stack[i] =
            uvec2(states[at + kStateStack + 2u * i], states[at + kStateStack + 2u * i + 1u]);
    }
}

void save_state(uint slot) {
    uint at = slot * kStateUints;
    states[at] = current;
    states[at + 1u] = stack_size | (triangle << 16u);
    for (uint k = 0u; k < 4u; ++k) states[at + 2u + k] = answer[k];
    for (uint i = 0u; i < stack_size; ++i) {
        states[at + kStateStack + 2u * i] = stack[i].x;
        states[at + kStateStack + 2u * i + 1u] = stack[i].y;
    }
}

/// The index of the query of this lane; false for a lane without one.
bool find_query(out uint query) {
    uint lane = gl_GlobalInvocationID.x;
    query = lane;
    if (lane >= args.count) return false;
    if (args.round != kRoundAll) query = work.queries[args.first + lane];
    return true;
}

/// Goes on until the answer is known or the steps are used up. `answer` is set to that of no
/// triangles, and what else the functions need has been set.
void answer_query(uint query) {
    uint slot = gl_GlobalInvocationID.x;
    current = 0u;
    triangle = 0u;
    stack_size = 0u;
    if (args.round == kRoundAgain) load_state(slot);
    uint steps = 0u;
    while (current != kEmptyChild && steps < kSteps) {
        if ((current & kLeafBit) == 0u) {
            steps += visit_node();
        } else {
            steps += visit_triangle();
        }
    }
    answers[query] = answer;
    if (args.round == kRoundAll) {
        if (current != kEmptyChild) {
            // The order of the list depends on the schedule; the answers do not.
            work.queries[atomicAdd(work.header.suspended_count, 1u)] = query;
        }
        return;
    }
    save_state(slot);
    if (current != kEmptyChild) atomicAdd(work.header.unfinished_count, 1u);
}
