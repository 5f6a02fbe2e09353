// The refit of boxes, level by level from the leaves up (I. Wald, S. Boulos, P. Shirley. Ray
// Tracing Deformable Scenes Using Dynamic Bounding Volume Hierarchies. ACM TOG 26(1), 2007, section
// 4). An atomic climb would take a single dispatch, but gives wrong boxes on devices whose
// device-scope barriers fail in non-uniform control flow.
#ifndef SHADERS_REFIT_REFIT_GLSL
#define SHADERS_REFIT_REFIT_GLSL

#include "shaders/kernel_interface.h"

layout(local_size_x = kGroupSize) in;

layout(push_constant) uniform Arguments { RefitArguments args; };
// One element a plane, since different lanes write the children of a node.
layout(binding = kBindNodesOut, r32ui) writeonly uniform uimageBuffer nodes_out;

void store_plane(uint node, uint planes, uint slot, float value) {
    uint at = 4u * (node * kNodeVec4s + planes) + slot;
    imageStore(nodes_out, int(at), uvec4(floatBitsToUint(value), 0u, 0u, 0u));
}

/// Writes a box to its parent's slot; `parent` is node * kWidth + slot.
void store_box(uint parent, vec3 lower, vec3 upper) {
    uint node = parent / kWidth;
    uint slot = parent % kWidth;
    store_plane(node, kNodeLowerX, slot, lower.x);
    store_plane(node, kNodeUpperX, slot, upper.x);
    store_plane(node, kNodeLowerY, slot, lower.y);
    store_plane(node, kNodeUpperY, slot, upper.y);
    store_plane(node, kNodeLowerZ, slot, lower.z);
    store_plane(node, kNodeUpperZ, slot, upper.z);
}

#endif  // SHADERS_REFIT_REFIT_GLSL
