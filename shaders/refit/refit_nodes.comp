// Writes the boxes of one level of nodes to the slots of their parents. Empty slots hold inverted
// boxes, which are neutral in a union.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/base/exact.glsl"

#include "shaders/refit/refit.glsl"

layout(binding = kBindRefittedNodes) uniform usamplerBuffer nodes;
layout(binding = kBindNodeParents) uniform usamplerBuffer node_parents;

float lowest(uint at) {
    vec4 v = min(min(uintBitsToFloat(texelFetch(nodes, int(at))),
                     uintBitsToFloat(texelFetch(nodes, int(at + 1u)))),
                 min(uintBitsToFloat(texelFetch(nodes, int(at + 2u))),
                     uintBitsToFloat(texelFetch(nodes, int(at + 3u)))));
    return min(min(v.x, v.y), min(v.z, v.w));
}

float highest(uint at) {
    vec4 v = max(max(uintBitsToFloat(texelFetch(nodes, int(at))),
                     uintBitsToFloat(texelFetch(nodes, int(at + 1u)))),
                 max(uintBitsToFloat(texelFetch(nodes, int(at + 2u))),
                     uintBitsToFloat(texelFetch(nodes, int(at + 3u)))));
    return max(max(v.x, v.y), max(v.z, v.w));
}

void main() {
    if (gl_GlobalInvocationID.x >= args.count) return;
    uint node = args.first + gl_GlobalInvocationID.x;
    uint at = node * kNodeVec4s;
    vec3 lower = vec3(lowest(at + kNodeLowerX), lowest(at + kNodeLowerY), lowest(at + kNodeLowerZ));
    vec3 upper =
        vec3(highest(at + kNodeUpperX), highest(at + kNodeUpperY), highest(at + kNodeUpperZ));
    store_box(texelFetch(node_parents, int(node)).x, lower, upper);
}
