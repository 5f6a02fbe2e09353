// The arguments of queries, and the triangles that others of the tree stand for.
#ifndef SHADERS_QUERIES_QUERY_GLSL
#define SHADERS_QUERIES_QUERY_GLSL

#extension GL_EXT_control_flow_attributes : require

#include "shaders/base/buffers.glsl"
#include "shaders/kernel_interface.h"

layout(push_constant) uniform Arguments { QueryArguments args; };
READ1(Repeated, repeated, kBindRepeated);

/// The first place of (first, prim_id) or what is greater: at most 28 iterations.
uint place_of_repeat(uint first, uint prim_id) {
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
    return place_of_repeat(first + 1u, 0u) - place_of_repeat(first, 0u);
}

/// The first triangle that `first` stands for from `prim_id` on, or kNoPrim.
uint first_repeat(uint first, uint prim_id) {
    uint place = place_of_repeat(first, prim_id);
    if (place == args.repeated_count || AT1(repeated, 2u * place) != first)
        return kNoPrim;
    return AT1(repeated, 2u * place + 1u);
}

#endif  // SHADERS_QUERIES_QUERY_GLSL
