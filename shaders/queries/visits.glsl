// A query about all triangles in some boxes, one query a lane: a traversal of the shared layout that
// can stop after any step and go on later. Of a node's children the one with the least key is visited
// first. A kernel calls answer_query(), and defines the functions that are declared here.
#include "shaders/tree.glsl"

/// What has been found, which the host reads.
uvec4 answer;
/// Whether a box is to be visited, and its key.
bool meets(vec3 lower, vec3 upper, out uint key);
/// Whether a box of this key need no longer be visited.
bool is_over(uint key);
/// Returns the steps that it took besides one.
uint test_triangle(vec3 a, vec3 b, vec3 c, uint prim_id);

layout(constant_id = kConstantStepBudget) const uint kSteps = kQueryStepBudget;
layout(push_constant) uniform Arguments { QueryArguments args; };

READ1(Repeated, repeated, kBindRepeated);
layout(std430, binding = kBindHits) buffer Answers { uvec4 answers[]; };
layout(std430, binding = kBindStates) buffer States { uint states[]; };
layout(std430, binding = kBindWork) buffer Work {
    WorkHeader header;
    uint queries[];
} work;

/// The index of the first pair that is not less than (first, prim_id): at most 28 iterations.
uint index_of_repeat(uint first, uint prim_id) {
    uint low = 0u;
    uint high = args.repeated_count;
    [[dont_unroll]] while (low < high) {
        uint middle = (low + high) / 2u;
        uint at = AT1(repeated, 2u * middle);
        uint repeat = AT1(repeated, 2u * middle + 1u);
        bool is_below = at < first || (at == first && repeat < prim_id);
        low = is_below ? middle + 1u : low;
        high = is_below ? high : middle;
    }
    return low;
}

/// The number of triangles that `first` stands for besides itself.
uint count_repeats(uint first) {
    if (args.repeated_count == 0u) return 0u;
    return index_of_repeat(first + 1u, 0u) - index_of_repeat(first, 0u);
}

/// The first triangle from `prim_id` on that `first` stands for, or kNoPrim.
uint first_repeat(uint first, uint prim_id) {
    uint i = index_of_repeat(first, prim_id);
    if (i == args.repeated_count || AT1(repeated, 2u * i) != first) return kNoPrim;
    return AT1(repeated, 2u * i + 1u);
}

// The state of the traversal: the next node or leaf (kEmptyChild at the end), the next triangle of
// that leaf, and the boxes after it as (child, key).
uint current;
uint triangle;
uint stack_size;
uvec2 stack[kMaxStack];

void pop_next() {
    triangle = 0u;
    current = kEmptyChild;
    if (stack_size == 0u) return;
    stack_size -= 1u;
    current = stack[stack_size].x;
}

/// Pops boxes that are over; returns their number.
uint skip_boxes() {
    uint steps = 0u;
    while (stack_size > 0u && is_over(stack[stack_size - 1u].y)) {
        stack_size -= 1u;
        steps += 1u;
    }
    return steps;
}

uint visit_node() {
    uint nearest = 0xFFFFFFFFu;
    uint next = kEmptyChild;
    for (uint quarter = 0u; quarter < 4u; ++quarter) {
        vec4 lower_x = four_planes(current, quarter, 0u, 0u);
        vec4 upper_x = four_planes(current, quarter, 0u, 1u);
        vec4 lower_y = four_planes(current, quarter, 1u, 0u);
        vec4 upper_y = four_planes(current, quarter, 1u, 1u);
        vec4 lower_z = four_planes(current, quarter, 2u, 0u);
        vec4 upper_z = four_planes(current, quarter, 2u, 1u);
        uvec4 child = four_children(current, quarter);
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
        pop_next();
    }
    return steps;
}

/// One triangle of the leaf.
uint visit_triangle() {
    uint leaf = leaf_of(current);
    uint count = leaf_triangle_count(leaf);
    uint steps = 1u;
    if (triangle < count) {
        vec3 a, b, c;
        leaf_triangle(leaf, triangle, a, b, c);
        steps += test_triangle(a, b, c, leaf_prim(leaf, triangle));
        triangle += 1u;
    }
    if (triangle >= count) {
        steps += skip_boxes();
        pop_next();
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

/// Continues until the answer is known or the steps are used up. `answer` must be that of no
/// triangles, and the globals of the kernel's functions must be set.
void answer_query(uint query) {
    uint slot = gl_GlobalInvocationID.x;
    current = 0u;
    triangle = 0u;
    stack_size = 0u;
    if (args.round == kRoundAgain) load_state(slot);
    uint steps = 0u;
    while (current != kEmptyChild && steps < kSteps) {
        if (!is_leaf(current)) {
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
