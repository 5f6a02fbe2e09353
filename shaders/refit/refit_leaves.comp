// Writes positions to leaves, and padded boxes to parents' slots and for groups of four triangles.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/kernel.glsl"
#include "common/interop/slab.h"
#include "shaders/refit/refit.glsl"

READ3(Positions, positions, kBindPositions);
READ1(LeafVertices, leaf_vertices, kBindLeafVertices);
READ1(LeafParents, leaf_parents, kBindLeafParents);
WORDS(GroupWords, group_words, kBindGroupWords);

#ifdef STORAGE_BUFFERS
// Whole vectors, of which the last word stays, so that 16 lanes write 256 bytes in sequence.
layout(std430, binding = kBindLeafWords) buffer LeafWords { uvec4 leaf_vectors[]; };
uint load_corners(uint at) { return leaf_vectors[at].w; }
void store_vertex(uint at, uvec3 bits, uint corners) { leaf_vectors[at] = uvec4(bits, corners); }
#else
layout(binding = kBindLeafWords, r32ui) uniform uimageBuffer leaf_words;
uint load_corners(uint at) { return imageLoad(leaf_words, int(4u * at + 3u)).x; }
void store_vertex(uint at, uvec3 bits, uint corners) {
    imageStore(leaf_words, int(4u * at), uvec4(bits.x));
    imageStore(leaf_words, int(4u * at + 1u), uvec4(bits.y));
    imageStore(leaf_words, int(4u * at + 2u), uvec4(bits.z));
}
#endif

/// Plane p of a box as stored, moved outwards; an empty box, neutral in a union, stays.
float padded_plane(uint p, float planes[6]) {
    vec3 lower = vec3(planes[0], planes[2], planes[4]);
    vec3 upper = vec3(planes[1], planes[3], planes[5]);
    float plane = planes[p];
    if (lower.x > upper.x) return plane;
    float pad = plane_pad(plane, largest_extent(lower, upper));
    precise float moved = is_upper(p) ? plane + pad : plane - pad;
    return moved;
}

/// The box of the lane's triangle: the union of the lanes of its vertices.
void triangle_box(uint corners, out vec3 lower, out vec3 upper) {
    float planes[6];
    uint first_lane = gl_LocalInvocationID.x / kRefitLanes * kRefitLanes;
    for (uint p = 0u; p < 6u; ++p) {
        planes[p] = lane_planes[lane_plane_at(p, first_lane + corner(corners, 0u))];
        for (uint k = 1u; k < 3u; ++k) {
            uint at = lane_plane_at(p, first_lane + corner(corners, k));
            planes[p] = unite_planes(p, planes[p], lane_planes[at]);
        }
    }
    lower = vec3(planes[0], planes[2], planes[4]);
    upper = vec3(planes[1], planes[3], planes[5]);
}

void main() {
    uint leaf = refit_item();
    uint lane = refit_lane();
    vec3 lower = vec3(kEmptyPlane);
    vec3 upper = vec3(-kEmptyPlane);
    uint corners = 0u;
    if (is_within()) {
        uint at = leaf * kLeafVec4s + lane;
        uvec3 bits = AT3(positions, AT1(leaf_vertices, leaf * kLeafVertices + lane));
        corners = load_corners(at);
        store_vertex(at, bits, corners);
        vec3 p = uintBitsToFloat(bits);
        bool is_finite = p.x <= kSceneExtent;
        lower = is_finite ? p : lower;
        upper = is_finite ? p : upper;
    }
    unite_quarters(lower, upper);
    if (is_within() && lane < 6u) {
        float planes[6];
        for (uint p = 0u; p < 6u; ++p) planes[p] = united_plane(p);
        store_plane(AT1(leaf_parents, leaf), lane, padded_plane(lane, planes));
    }
    bool has_triangle = lane < corner_triangle_count(corners);
    lower = vec3(kEmptyPlane);
    upper = vec3(-kEmptyPlane);
    if (has_triangle) triangle_box(corners, lower, upper);
    barrier();
    unite_quarters(lower, upper);
    if (!is_within()) return;
    for (uint word = lane; word < kQuarterWords; word += kRefitLanes) {
        float planes[6];
        for (uint p = 0u; p < 6u; ++p)
            planes[p] = quarter_planes[first_quarter_plane() + 4u * p + word % 4u];
        STORE_WORD(group_words, leaf * kQuarterWords + word, padded_plane(word / 4u, planes));
    }
}
