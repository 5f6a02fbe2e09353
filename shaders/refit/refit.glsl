// The refit of boxes, level by level from the leaves up (I. Wald, S. Boulos, P. Shirley. Ray
// Tracing Deformable Scenes Using Dynamic Bounding Volume Hierarchies. ACM TOG 26(1), 2007, section
// 4). 16 lanes take a leaf or a node, one for each of its vertices or children, so that they read
// and write memory in sequence; six of them reduce a plane each. An atomic climb would take a single
// dispatch, but gives wrong boxes on devices whose device-scope barriers fail in non-uniform control
// flow.
#ifndef SHADERS_REFIT_REFIT_GLSL
#define SHADERS_REFIT_REFIT_GLSL

#include "shaders/base/buffers.glsl"
#include "shaders/kernel_interface.h"

layout(local_size_x = kGroupSize) in;

layout(push_constant) uniform Arguments { RefitArguments args; };

#ifdef STORAGE_BUFFERS
layout(std430, binding = kBindNodeWords) buffer NodeWords { uint node_words[]; };
float load_plane(uint at) { return uintBitsToFloat(node_words[at]); }
void store_plane(uint at, float value) { node_words[at] = floatBitsToUint(value); }
#else
layout(binding = kBindNodeWords, r32ui) uniform uimageBuffer node_words;
float load_plane(uint at) { return uintBitsToFloat(imageLoad(node_words, int(at)).x); }
void store_plane(uint at, float value) {
    imageStore(node_words, int(at), uvec4(floatBitsToUint(value), 0u, 0u, 0u));
}
#endif

const uint kNodeWords = 4u * kNodeVec4s;

uint refit_lane() { return gl_LocalInvocationID.x % kRefitLanes; }

/// The leaf or node of the lane; only if is_within().
uint refit_item() { return args.first + gl_GlobalInvocationID.x / kRefitLanes; }

bool is_within() { return gl_GlobalInvocationID.x / kRefitLanes < args.count; }

/// The first word of plane p of a node: lower x, upper x, lower y, ...
uint plane_at(uint node, uint p) { return node * kNodeWords + 4u * (kNodeUpperX - kNodeLowerX) * p; }

/// The boxes of all lanes, plane by plane. One more word a plane spreads them over banks of memory.
shared float lane_planes[6u * (kGroupSize + 1u)];
/// The boxes of leaves or nodes.
shared float item_planes[6u * kGroupSize / kRefitLanes];

/// The union of the boxes of 16 lanes, for each of these. All lanes of a workgroup call it at once.
void unite(inout vec3 lower, inout vec3 upper) {
    uint lane = gl_LocalInvocationID.x;
    float planes[6] = float[](lower.x, upper.x, lower.y, upper.y, lower.z, upper.z);
    for (uint p = 0u; p < 6u; ++p) lane_planes[p * (kGroupSize + 1u) + lane] = planes[p];
    barrier();
    uint p = refit_lane();
    uint item = lane / kRefitLanes;
    if (p < 6u) {
        uint at = p * (kGroupSize + 1u) + item * kRefitLanes;
        // Upper planes are turned round, so that one loop serves both.
        float turn = (p & 1u) == 0u ? 1.0f : -1.0f;
        float least = turn * lane_planes[at];
        for (uint i = 1u; i < kRefitLanes; ++i) least = min(least, turn * lane_planes[at + i]);
        item_planes[item * 6u + p] = turn * least;
    }
    barrier();
    uint at = item * 6u;
    lower = vec3(item_planes[at], item_planes[at + 2u], item_planes[at + 4u]);
    upper = vec3(item_planes[at + 1u], item_planes[at + 3u], item_planes[at + 5u]);
}

/// Writes a box, which all lanes of an item have, to its parent's slot; `parent` is
/// node * kWidth + slot.
void store_box(uint parent, vec3 lower, vec3 upper) {
    uint p = refit_lane();
    if (p >= 6u) return;
    float planes[6] = float[](lower.x, upper.x, lower.y, upper.y, lower.z, upper.z);
    store_plane(plane_at(parent / kWidth, p) + parent % kWidth, planes[p]);
}

#endif  // SHADERS_REFIT_REFIT_GLSL
