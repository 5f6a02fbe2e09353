// The leaves of a packet: projects vertices, culls triangles, and lists the rest.
#ifndef SHADERS_PACKET_PACKET_LEAF_GLSL
#define SHADERS_PACKET_PACKET_LEAF_GLSL

#include "common/interop/packet_bounds.h"
#include "shaders/packet/packet.glsl"

/// The leaf's projected vertices; x is kFarAway for those that are not finite.
vec3 projected[kSlots];
/// The local vertex indices of its triangles, packed.
uint packed_indices[kSlots];
/// Bound of the summed errors of x, y and z of a projected vertex that is displaced by the rule.
float leaf_error;

/// Bound of the change of x - X z and y - Y z together, by a unit step in x, y and z of scene
/// space, for |X|, |Y| up to 17 (beyond that ray_error is as large).
float row_sizes() {
    return frame.row_size.x + frame.row_size.y + 34.0f * frame.row_size.z + frame.row_shift;
}

/// Projects the reference, the leaf's first vertex, accurately, and the others by rows * (v -
/// reference), off by at most 6 u row_size extent and 2 u of the result (docs/design/arithmetic.md,
/// "Packets").
void project_vertices(uint leaf) {
    vec3 v[kSlots];
    [[unroll]] for (uint h = 0u; h < kSlots; ++h) {
        uvec4 words = imageLoad(leaves, int(leaf * kLeafVec4s + h * kLanes + lane));
        v[h] = uintBitsToFloat(words.xyz);
        packed_indices[h] = words.w;
    }
    vec3 reference = read_lane(v[0], 0u);
    // Any point can replace a vertex that is not finite.
    reference = reference.x > kSceneExtent ? vec3(0.0f) : reference;
    precise vec3 p = reference - frame.org;
    vec3 p_error = vec3(difference_error(reference.x, frame.org.x, p.x),
                        difference_error(reference.y, frame.org.y, p.y),
                        difference_error(reference.z, frame.org.z, p.z));
    float own = accurate_dot(frame.own_row, frame.own_row_error, p, p_error);
    vec3 at = vec3(read_lane(own, 0u), read_lane(own, 1u), read_lane(own, 2u));
    float extent = 0.0f;
    [[unroll]] for (uint h = 0u; h < kSlots; ++h) {
        bool is_finite = v[h].x <= kSceneExtent;
        precise vec3 d = v[h] - reference;
        d = is_finite ? d : vec3(0.0f);
        extent = greater(extent, greater(abs(d.x), greater(abs(d.y), abs(d.z))));
        precise vec3 moved =
            at + vec3(dot3(frame.row_x, d), dot3(frame.row_y, d), dot3(frame.row_z, d));
        projected[h] = is_finite ? moved : vec3(kFarAway);
    }
    extent = cluster_max(extent);
    leaf_error = row_sizes() * (kExtentError * extent +
                                (kDistanceError * largest_component(p) + kGridError)) +
                 kPlaneFloor;
}

vec3 projected_vertex(uint slot) {
    uint from = slot & (kLanes - 1u);
    vec3 v = read_lane(projected[0], from);
    [[unroll]] for (uint h = 1u; h < kSlots; ++h) {
        vec3 other = read_lane(projected[h], from);
        v = slot / kLanes == h ? other : v;
    }
    return v;
}

/// A triangle's projected vertices, one a component.
struct ProjectedTriangle {
    vec3 x;
    vec3 y;
    vec3 z;
};

ProjectedTriangle project_triangle(uint words) {
    vec3 a = projected_vertex(corner(words, 0u));
    vec3 b = projected_vertex(corner(words, 1u));
    vec3 c = projected_vertex(corner(words, 2u));
    return ProjectedTriangle(vec3(a.x, b.x, c.x), vec3(a.y, b.y, c.y), vec3(a.z, b.z, c.z));
}

float least(vec3 v) { return lesser(v.x, lesser(v.y, v.z)); }
float most(vec3 v) { return greater(v.x, greater(v.y, v.z)); }

/// The rectangles of the groups, for rays that are not at the middles of pixels.
vec2 group_lower[kGroups];
vec2 group_upper[kGroups];

/// Whether a triangle is certainly so far in front of the origin that it can be projected.
bool is_in_front(float z_least, float z_size, float error) {
    return z_least > 0.0009765625f * z_size + 16.0f * error;
}

/// The groups with rays that may hit a triangle, as bits: its rectangle meets theirs and, if rays
/// are at the middles of pixels (on_grid), covers one; it is in front of the origin, and nearer
/// than the hits of all rays of the group.
uint concerned_groups(ProjectedTriangle t, bool on_grid) {
    bool is_finite = most(t.x) < kFarAway;
    float z_least = least(t.z);
    float z_most = most(t.z);
    float z_size = greater(abs(z_least), abs(z_most));
    float z_error = kDepthError * z_size + leaf_error;
    bool in_front = is_in_front(z_least, z_size, leaf_error);
    vec3 rz = vec3(1.0f) / t.z;
    vec3 x = t.x * rz;
    vec3 y = t.y * rz;
    vec2 low = vec2(least(x), least(y));
    vec2 high = vec2(most(x), most(y));
    float margin = kRectangleError * leaf_error * most(rz) + kRectangleRounding;
    low = low - kDeviceQuotientError * abs(low) - margin;
    high = high + kDeviceQuotientError * abs(high) + margin;
    uint groups = 0u;
    if (on_grid) {
        // Most small triangles cover no pixel's middle, which is at k + 0.5 for a whole k.
        vec2 first = ceil(low - frame.ray_error - vec2(0.5f));
        vec2 last = floor(high + frame.ray_error - vec2(0.5f));
        bool is_any = first.x <= last.x && first.y <= last.y;
        uint columns = (first.x <= -1.0f && last.x >= -8.0f ? 1u : 0u) |
                       (first.x <= 7.0f && last.x >= 0.0f ? 2u : 0u);
        [[unroll]] for (uint row = 0u; row < kGroups / 2u; ++row) {
            float begin = 4.0f * float(row) - float(kGroups);
            groups |= first.y <= begin + 3.0f && last.y >= begin ? columns << (2u * row) : 0u;
        }
        groups = is_any ? groups : 0u;
    } else {
        [[unroll]] for (uint g = 0u; g < kGroups; ++g) {
            bool meets = low.x <= group_upper[g].x && low.y <= group_upper[g].y &&
                         high.x >= group_lower[g].x && high.y >= group_lower[g].y;
            groups |= meets ? 1u << g : 0u;
        }
    }
    groups = in_front ? groups : kAllGroups;
    float q = nearest_q(z_least - z_error);
    [[unroll]] for (uint g = 0u; g < kGroups; ++g) {
        groups = q >= group_q[g] ? groups : groups & ~(1u << g);
    }
    return is_finite && z_most + z_error > 0.0f ? groups : 0u;
}

/// The concerned_groups() of the leaf's triangles.
uint triangle_groups[kSlots];

/// Returns the triangles of a leaf that rays of the packet may hit, as bits. Sets projected,
/// packed_indices, leaf_error and triangle_groups.
uint cull_leaf(uint leaf, bool on_grid) {
    project_vertices(leaf);
    uint alive = 0u;
    [[unroll]] for (uint h = 0u; h < kSlots; ++h) {
        uint words = packed_indices[h];
        uint i = lane + kLanes * h;
        uint groups = concerned_groups(project_triangle(words), on_grid);
        triangle_groups[h] = i < corner_triangle_count(words) ? groups : 0u;
        alive |= triangle_groups[h] != 0u ? 1u << i : 0u;
    }
    return cluster_or(alive);
}

/// Names a triangle by its leaf and its slot there.
uint triangle_name(uint leaf, uint i) { return leaf * 16u + i; }
const uint kNoTriangle = 0xFFFFFFFFu;

/// Triangles that wait to be traced, one on each of the first lanes: name, groups of rays that may
/// hit it (0: it was traced), projected vertices and their error.
uint pending_count;
uint pending_names;
uint pending_groups;
ProjectedTriangle pending_triangle;
float pending_error;
/// The number of pending triangles that are traced while more leaves follow.
const uint kEnough = kLanes - kLanes / 4u;

/// Adds the leaf's triangles `alive` (bits) to the pending ones until all lanes have one. Returns
/// the rest.
uint append_triangles(uint leaf, uint alive) {
    uint rest = alive;
    [[unroll]] for (uint k = 0u; k < kLanes - 1u; ++k) {
        rest = lane > k + pending_count ? rest & (rest - 1u) : rest;
    }
    bool is_new = lane >= pending_count && rest != 0u;
    uint triangle = uint(findLSB(rest)) & 15u;
    uint from = triangle & (kLanes - 1u);
    uint words = read_lane(packed_indices[0], from);
    uint groups = read_lane(triangle_groups[0], from);
    [[unroll]] for (uint h = 1u; h < kSlots; ++h) {
        uint other = read_lane(packed_indices[h], from);
        uint other_groups = read_lane(triangle_groups[h], from);
        words = triangle / kLanes == h ? other : words;
        groups = triangle / kLanes == h ? other_groups : groups;
    }
    ProjectedTriangle t = project_triangle(words);
    pending_triangle.x = is_new ? t.x : pending_triangle.x;
    pending_triangle.y = is_new ? t.y : pending_triangle.y;
    pending_triangle.z = is_new ? t.z : pending_triangle.z;
    pending_error = is_new ? leaf_error : pending_error;
    pending_groups = is_new ? groups : pending_groups;
    pending_names = is_new ? triangle_name(leaf, triangle) : pending_names;
    pending_count = cluster_max(is_new ? lane + 1u : pending_count);
    return alive & ~cluster_or(is_new ? 1u << triangle : 0u);
}

/// Reads the vertices of a triangle. Returns its prim_id.
uint named_triangle(uint name, out vec3 a, out vec3 b, out vec3 c) {
    uint i = name & 15u;
    uint at = (name >> 4u) * kLeafVec4s;
    leaf_triangle(at, i, a, b, c);
    return leaf_prim(at, i);
}

#endif  // SHADERS_PACKET_PACKET_LEAF_GLSL
