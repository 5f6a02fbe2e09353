// Queries about all triangles in some boxes in the traversal, one a lane. A kernel calls answer_query(),
// and defines last_key() and the functions that are declared here.

/// Whether a box is to be visited, and its key.
bool meets(vec3 lower, vec3 upper, out int key);
/// Returns the steps that it took besides one.
uint test_triangle(vec3 a, vec3 b, vec3 c, uint prim_id);

layout(constant_id = kConstantStepBudget) const uint kSteps = kQueryStepBudget;
layout(constant_id = kConstantStackRoom) const uint kStackRoom = kMaxStack;
const uint kStackSize = kStackRoom;
layout(push_constant) uniform Arguments { QueryArguments args; };

READ1(Repeated, repeated, kBindRepeated);
layout(std430, binding = kBindHits) buffer Answers { uvec4 answers[]; };
layout(std430, binding = kBindWork) buffer Work {
    WorkHeader header;
    uint queries[];
} work;

#define RESUMES
#include "shaders/traversal.glsl"

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

uint meet_children(uint node) {
    for (uint quarter = 0u; quarter < 4u; ++quarter) {
        vec4 lower_x = four_planes(node, quarter, 0u, 0u);
        vec4 upper_x = four_planes(node, quarter, 0u, 1u);
        vec4 lower_y = four_planes(node, quarter, 1u, 0u);
        vec4 upper_y = four_planes(node, quarter, 1u, 1u);
        vec4 lower_z = four_planes(node, quarter, 2u, 0u);
        vec4 upper_z = four_planes(node, quarter, 2u, 1u);
        uvec4 child = four_children(node, quarter);
        for (uint i = 0u; i < 4u; ++i) {
            int key;
            bool is_met = meets(vec3(lower_x[i], lower_y[i], lower_z[i]),
                                vec3(upper_x[i], upper_y[i], upper_z[i]), key);
            if (is_met && child[i] != kEmptyChild) consider(child[i], key);
        }
    }
    return 30u;
}

/// One triangle, as some take many steps.
uint test_triangles(uint leaf, uint count) {
    if (count == 0u) return 1u;
    vec3 a, b, c;
    leaf_triangle(leaf, triangle, a, b, c);
    uint steps = test_triangle(a, b, c, leaf_prim(leaf, triangle));
    triangle = triangle + 1u < count ? triangle + 1u : 0u;
    return 1u + steps;
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
    begin_traversal();
    if (args.round == kRoundAgain) load_state(slot);
    traverse();
    answers[query] = answer;
    if (args.round == kRoundAll) {
        if (!finished()) {
            // The order of the list depends on the schedule; the answers do not.
            work.queries[atomicAdd(work.header.suspended_count, 1u)] = query;
        }
        return;
    }
    save_state(slot);
    if (!finished()) atomicAdd(work.header.unfinished_count, 1u);
}
