// Packets of rays with a common origin over the shared layout, one packet a cluster of lanes. Lanes
// are in turn a node's children, a leaf's vertices, its triangles, and rays.
//
// Based on: I. Wald, S. Boulos, P. Shirley. Ray Tracing Deformable Scenes Using Dynamic Bounding
// Volume Hierarchies. ACM TOG 26(1), 2007: packets far larger than a vector, one conservative test
// of the whole packet a node, ordered descent. Triangles are set up as homogeneous edge functions
// of the packet's own plane (M. Olano, T. Greer. Triangle scan conversion using 2D homogeneous
// coordinates. 1997), so that no vertex beside or behind the eye needs clipping.
//
// Nothing here decides a hit. Edge functions and 1/z carry bounds of their distance from what the
// hit rule (common/interop/triangle.h) computes; where a bound leaves a doubt, the rule is asked.
// So all arithmetic but that of accurate_dot may be fused and reordered.
//
// Some devices mask branches instead of jumping over them, and run the body of a loop at least
// once. So loops here are nested such that each body has something to do most times it is run.
#ifndef SHADERS_PACKET_GLSL
#define SHADERS_PACKET_GLSL

#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_shuffle : require
#extension GL_EXT_control_flow_attributes : require

#include "common/interop/slab.h"
#include "common/interop/triangle.h"
#include "shaders/kernel_interface.h"

/// Lanes of a cluster: 4, 8 or 16, a part of a subgroup.
layout(constant_id = kConstantPacketLanes) const uint kLanes = 8u;
layout(constant_id = kConstantStepBudget) const uint kSteps = kPacketStepBudget;
/// Children, vertices or triangles that each lane has of 16.
const uint kSlots = 16u / kLanes;

layout(binding = kBindNodes) uniform usamplerBuffer nodes;
layout(binding = kBindLeaves) uniform usamplerBuffer leaves;

uint lane;        // within the cluster
uint first_lane;  // of the cluster, within the subgroup

void find_lane() {
    lane = gl_SubgroupInvocationID & (kLanes - 1u);
    first_lane = gl_SubgroupInvocationID - lane;
}

uint read_lane(uint x, uint from) { return subgroupShuffle(x, first_lane + from); }
float read_lane(float x, uint from) { return subgroupShuffle(x, first_lane + from); }
vec3 read_lane(vec3 v, uint from) {
    return vec3(read_lane(v.x, from), read_lane(v.y, from), read_lane(v.z, from));
}

/// The built-in ones look for NaNs.
float lesser(float a, float b) { return a < b ? a : b; }
float greater(float a, float b) { return a > b ? a : b; }
vec2 greater(vec2 a, vec2 b) { return vec2(greater(a.x, b.x), greater(a.y, b.y)); }

/// Reductions over a cluster, on all of its lanes.
#define DEFINE_CLUSTER_REDUCTION(NAME, TYPE, COMBINE)                               \
    TYPE NAME(TYPE x) {                                                             \
        x = COMBINE(x, subgroupShuffleXor(x, 1u));                                  \
        x = COMBINE(x, subgroupShuffleXor(x, 2u));                                  \
        if (kLanes >= 8u) x = COMBINE(x, subgroupShuffleXor(x, 4u));                \
        if (kLanes >= 16u) x = COMBINE(x, subgroupShuffleXor(x, 8u));               \
        return x;                                                                   \
    }
uint bitwise_or(uint a, uint b) { return a | b; }
DEFINE_CLUSTER_REDUCTION(cluster_max, uint, max)
DEFINE_CLUSTER_REDUCTION(cluster_max, float, greater)
DEFINE_CLUSTER_REDUCTION(cluster_min, float, lesser)
DEFINE_CLUSTER_REDUCTION(cluster_or, uint, bitwise_or)

/// In place of 1/z: of rays that want no more, and of what reaches to the eye.
const float kDone = 1.0e38f;
const float kAnyDepth = 3.0e37f;
/// In place of x, of vertices that are not finite.
const float kFarAway = 1.0e36f;

/// The packet's projection: a point p relative to the origin has (x, y, z) = rows * p and is seen at
/// (x / z, y / z). Every ray has z > 0 and passes the plane within [lower, upper].
struct PacketFrame {
    vec3 org;
    vec3 row_x;
    vec3 row_y;
    vec3 row_z;
    /// The row that this lane computes accurately (lane 0: x, 1: y, else z), and what its floats
    /// leave out.
    vec3 own_row;
    vec3 own_row_error;
    /// Sums of the magnitudes of each row.
    vec3 row_size;
    vec2 lower;
    vec2 upper;
    /// How far x and y of a ray may be from those it is taken for.
    vec2 ray_error;
    /// How much nearer than exact the rule may place a hit, in z.
    float depth_error;
    /// Roundings of an edge function over the packet, relative to the size of its coefficients.
    float rounding;
};

PacketFrame frame;

/// row_error * p and row * p_error added to row * p, so that about 2^-44 of the sum of magnitudes
/// remains (T. Ogita, S. Rump, S. Oishi. Accurate sum and dot product. 2005, algorithm Dot2).
float accurate_dot(vec3 row, vec3 row_error, vec3 p, vec3 p_error) {
    precise float x = row.x * p.x;
    precise float y = row.y * p.y;
    precise float z = row.z * p.z;
    precise float xy = x + y;
    precise float xyz = xy + z;
    precise float e = product_error(row.x, p.x, x) + product_error(row.y, p.y, y);
    e = e + product_error(row.z, p.z, z);
    e = e + difference_error(x, -y, xy);
    e = e + difference_error(xy, -z, xyz);
    e = e + dot3(row_error, p);
    e = e + dot3(row, p_error);
    precise float sum = xyz + e;
    return sum;
}

/// Largest coordinate of a point of the scene relative to the origin.
float scene_reach() { return kSceneExtent + largest_component(frame.org); }

// --- nodes ---

/// Of six sums over a box's planes, what this lane's planes are multiplied by: four sides, the far
/// end, the near end. With 4 lanes each has lower and upper planes, else lanes 4 to 7 (12 to 15) the
/// upper ones.
vec3 plane_factors[6];
vec3 other_factors[6];
/// What the sums may be off by, the triangles' reach out of their boxes included.
float plane_errors[6];

void set_planes() {
    vec3 sides[6] =
        vec3[6](frame.row_x - frame.lower.x * frame.row_z, frame.upper.x * frame.row_z - frame.row_x,
                frame.row_y - frame.lower.y * frame.row_z, frame.upper.y * frame.row_z - frame.row_y,
                frame.row_z, frame.row_z);
    float reach = scene_reach();
    bool upper = kLanes >= 8u && (lane & 4u) != 0u;
    [[unroll]] for (uint i = 0u; i < 6u; ++i) {
        // The last is the least z; it wants the other corner.
        bool largest = (i < 5u) == upper;
        plane_factors[i] = largest ? max(sides[i], vec3(0.0f)) : min(sides[i], vec3(0.0f));
        other_factors[i] = largest ? min(sides[i], vec3(0.0f)) : max(sides[i], vec3(0.0f));
        float size = i < 2u   ? frame.row_size.x + 32.0f * frame.row_size.z
                     : i < 4u ? frame.row_size.y + 32.0f * frame.row_size.z
                              : frame.row_size.z;
        // 2^-19 of the largest terms: 8 * 2^-24 of rounding (rows, differences, products, sums),
        // and 8 * 2^-24 by which the rule displaces vertices, twice over.
        plane_errors[i] = 1.9073486328125e-06f * size * reach;
    }
}

/// What is to be visited in the node that was visited last: for each child of this lane that is left
/// its key (bits of 1/z at its nearest, the slot in the last four; 0: none) and its index.
uint keys[kSlots];
uint children[kSlots];
/// Keys and children of the nodes above.
const uint kLevelWords = (kSlots + 1u) / 2u;
uvec4 levels[kLevelWords * (kMaxDepth + 1u)];
uint level;

/// Least 1/z of what the rays have found: what is farther matters to none.
float packet_q;

void begin_traversal() {
    packet_q = 0.0f;
    level = 0u;
    [[unroll]] for (uint k = 0u; k < kSlots; ++k) {
        keys[k] = 0u;
        children[k] = kEmptyChild;
    }
}

void push_level() {
    [[unroll]] for (uint w = 0u; w < kLevelWords; ++w) {
        uint i = 2u * w;
        uint j = min(2u * w + 1u, kSlots - 1u);
        levels[level * kLevelWords + w] = uvec4(keys[i], keys[j], children[i], children[j]);
    }
    ++level;
}

void pop_level() {
    --level;
    [[unroll]] for (uint w = 0u; w < kLevelWords; ++w) {
        uvec4 words = levels[level * kLevelWords + w];
        uint i = 2u * w;
        uint j = min(2u * w + 1u, kSlots - 1u);
        keys[i] = words.x;
        keys[j] = words.y;
        children[i] = words.z;
        children[j] = words.w;
    }
}

/// The nearest child that is left and may still matter, or kEmptyChild.
uint take_child(inout uint steps) {
    uint child = kEmptyChild;
    bool more = true;
    do {
        uint best = keys[0];
        [[unroll]] for (uint k = 1u; k < kSlots; ++k) best = max(best, keys[k]);
        best = cluster_max(best);
        if (best != 0u && (best | 15u) >= floatBitsToUint(packet_q)) {
            uint slot = best & 15u;
            uint part = slot & 3u;
            uint owner = (slot >> 2u) + 4u * (part / kSlots);
            uint own = children[0];
            [[unroll]] for (uint k = 1u; k < kSlots; ++k) {
                own = part % kSlots == k ? children[k] : own;
            }
            child = read_lane(own, owner);
            [[unroll]] for (uint k = 0u; k < kSlots; ++k) keys[k] = keys[k] == best ? 0u : keys[k];
            more = false;
        } else if (level > 0u) {
            pop_level();
        } else {
            more = false;
        }
        ++steps;
    } while (more);
    return child;
}

vec4 fetch_planes(uint at, float org) {
    return uintBitsToFloat(texelFetch(nodes, int(at))) - vec4(org);
}

/// 1/z for the nearest that a hit may be which the rule finds from `z` on.
float nearest_q(float z) {
    float near = z - frame.depth_error;
    return near > 1.0e-20f ? 1.00001f / near : kAnyDepth;
}

/// Leaves the children that the packet may meet in keys and children. Lane l has boxes 4 (l % 4) to
/// 4 (l % 4) + 3 to compute, and keeps kSlots of them.
void visit_node(uint node) {
    push_level();
    uint at = node * kNodeVec4s + (lane & 3u);
    uint half_at = kLanes >= 8u ? at + (lane & 4u) : at;
    vec4 x = fetch_planes(half_at + kNodeLowerX, frame.org.x);
    vec4 y = fetch_planes(half_at + kNodeLowerY, frame.org.y);
    vec4 z = fetch_planes(half_at + kNodeLowerZ, frame.org.z);
    vec4 sums[6];
    [[unroll]] for (uint i = 0u; i < 6u; ++i) {
        sums[i] = x * plane_factors[i].x + y * plane_factors[i].y + z * plane_factors[i].z;
    }
    if (kLanes >= 8u) {
        [[unroll]] for (uint i = 0u; i < 6u; ++i) sums[i] += subgroupShuffleXor(sums[i], 4u);
    } else {
        x = fetch_planes(at + kNodeUpperX, frame.org.x);
        y = fetch_planes(at + kNodeUpperY, frame.org.y);
        z = fetch_planes(at + kNodeUpperZ, frame.org.z);
        [[unroll]] for (uint i = 0u; i < 6u; ++i) {
            sums[i] += x * other_factors[i].x + y * other_factors[i].y + z * other_factors[i].z;
        }
    }
    uvec4 child = texelFetch(nodes, int(at + kNodeChild));
    uint part = (lane >> 2u) * kSlots;
    [[unroll]] for (uint k = 0u; k < kSlots; ++k) {
        uint own = kLanes == 4u ? k : part + k;
        bool meets = child[own] != kEmptyChild;
        [[unroll]] for (uint i = 0u; i < 5u; ++i) meets = meets && sums[i][own] >= -plane_errors[i];
        float q = nearest_q(sums[5][own] - plane_errors[5]);
        meets = meets && q >= packet_q;
        uint slot = 4u * (lane & 3u) + own;
        keys[k] = meets ? (floatBitsToUint(q) & ~15u) | slot : 0u;
        children[k] = child[own];
    }
}

// --- leaves ---

/// The leaf's vertices, projected; x is kFarAway where they are not finite.
vec3 projected[kSlots];
/// Corners of its triangles.
uint corner_words[kSlots];
/// How far x, y and z of a projected vertex, displaced as the rule does, may be off in all.
float leaf_error;

/// The reference, the leaf's first vertex, is projected accurately; the others by rows * (v -
/// reference), off by at most 6 * 2^-24 row_size extent and 2 * 2^-24 of the result. The rule
/// displaces a vertex by 2^-22 of its distance from the ray, for a ray through the triangle at most
/// 8 * 2^-24 row_size extent.
void project_vertices(uint leaf) {
    vec3 v[kSlots];
    [[unroll]] for (uint h = 0u; h < kSlots; ++h) {
        uvec4 words = texelFetch(leaves, int(leaf * kLeafVec4s + h * kLanes + lane));
        v[h] = uintBitsToFloat(words.xyz);
        corner_words[h] = words.w;
    }
    vec3 reference = read_lane(v[0], 0u);
    // Any point will do in place of a vertex that is not finite.
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
    float row_sum = frame.row_size.x + frame.row_size.y + 34.0f * frame.row_size.z;
    // 2^-20 and 2^-41.
    leaf_error = row_sum * (9.5367431640625e-07f * extent +
                            4.547473508864641e-13f * largest_component(p));
}

vec3 projected_corner(uint slot) {
    uint from = slot & (kLanes - 1u);
    vec3 v = read_lane(projected[0], from);
    [[unroll]] for (uint h = 1u; h < kSlots; ++h) {
        vec3 other = read_lane(projected[h], from);
        v = slot / kLanes == h ? other : v;
    }
    return v;
}

/// A triangle's projected vertices, one a component.
struct Corners {
    vec3 x;
    vec3 y;
    vec3 z;
};

Corners projected_triangle(uint words) {
    vec3 a = projected_corner(corner(words, 0u));
    vec3 b = projected_corner(corner(words, 1u));
    vec3 c = projected_corner(corner(words, 2u));
    return Corners(vec3(a.x, b.x, c.x), vec3(a.y, b.y, c.y), vec3(a.z, b.z, c.z));
}

float least(vec3 v) { return lesser(v.x, lesser(v.y, v.z)); }
float most(vec3 v) { return greater(v.x, greater(v.y, v.z)); }

/// Whether a triangle may concern a ray of the packet: its rectangle meets the packet's, and covers
/// the middle of a pixel if the rays are those (on_grid); and it is in front of the origin, nearer
/// than what all rays have found.
bool may_concern_packet(Corners t, bool on_grid) {
    bool is_finite = most(t.x) < kFarAway;
    float z_least = least(t.z);
    float z_most = most(t.z);
    float z_size = greater(abs(z_least), abs(z_most));
    // 2^-22.
    float z_error = 2.384185791015625e-07f * z_size + leaf_error;
    // The rectangle, where the triangle is well in front of the origin.
    bool in_front = z_least > 0.0009765625f * z_size + 16.0f * leaf_error;
    vec3 rz = vec3(1.0f) / t.z;
    vec3 x = t.x * rz;
    vec3 y = t.y * rz;
    vec2 low = vec2(least(x), least(y));
    vec2 high = vec2(most(x), most(y));
    // 2^-19 of the value for roundings, and 2^-16.
    float margin = 2.0f * leaf_error * most(rz) + 1.52587890625e-05f;
    low = low - 1.9073486328125e-06f * abs(low) - margin;
    high = high + 1.9073486328125e-06f * abs(high) + margin;
    bool meets = low.x <= frame.upper.x && low.y <= frame.upper.y && high.x >= frame.lower.x &&
                 high.y >= frame.lower.y;
    if (on_grid) {
        // Most small triangles cover no pixel's middle, x = k + 0.5 for whole k, at all.
        vec2 first = ceil(low - frame.ray_error - vec2(0.5f));
        vec2 last = floor(high + frame.ray_error - vec2(0.5f));
        meets = meets && first.x <= last.x && first.y <= last.y;
    }
    return is_finite && (meets || !in_front) && z_most + z_error > 0.0f &&
           nearest_q(z_least - z_error) >= packet_q;
}

/// The triangles of a leaf that may concern the packet, as bits. Leaves projected, corner_words and
/// leaf_error.
uint cull_leaf(uint leaf, bool on_grid) {
    project_vertices(leaf);
    uint alive = 0u;
    [[unroll]] for (uint h = 0u; h < kSlots; ++h) {
        uint words = corner_words[h];
        uint i = lane + kLanes * h;
        bool meets = may_concern_packet(projected_triangle(words), on_grid);
        alive |= meets && i < corner_triangle_count(words) ? 1u << i : 0u;
    }
    return cluster_or(alive);
}

/// Edge functions a x + b y + c of the packet's plane, positive inside; their bound; 1/z likewise as
/// a function of x and y, and its bound.
struct Setup {
    vec3 a;
    vec3 b;
    vec3 c;
    vec3 q;
    float bound;
    float q_error;
};

/// Edge functions are taken in the point of the packet nearest to the first vertex. Let s bound |x|
/// + |y| of the vertices there, Z |z|, and `reach` |x| + |y| as seen from any ray of the packet. A
/// vertex is off by `error` (x - X z for |X| + |Y| <= 32 rounds by 2^-18 Z), so that an edge
/// function moves by at most 4 error (reach + error), twice the first-order term. Its own roundings
/// are at most frame.rounding s Z + 2^-20 s^2.
Setup set_up_triangle(Corners t) {
    float z_size = most(abs(t.z));
    float rz = t.z.x > 0.0f ? 1.0f / t.z.x : 0.0f;
    vec2 middle = clamp(vec2(t.x.x, t.y.x) * rz, frame.lower, frame.upper);
    vec3 px = t.x - middle.x * t.z;
    vec3 py = t.y - middle.y * t.z;
    float size = most(abs(px) + abs(py));
    vec2 span = frame.upper - frame.lower;
    float reach = (span.x + span.y) * z_size + size;
    // 2^-21 and 2^-18.
    float error = 4.76837158203125e-07f * size + 3.814697265625e-06f * z_size + leaf_error;
    // 2^-20.
    float rounding = size * (frame.rounding * z_size + 9.5367431640625e-07f * size);
    vec3 a = py.yzx * t.z.zxy - t.z.yzx * py.zxy;
    vec3 b = t.z.yzx * px.zxy - px.yzx * t.z.zxy;
    vec3 c = px.yzx * py.zxy - py.yzx * px.zxy;
    float det = px.x * a.x + py.x * b.x + t.z.x * c.x;
    float moved = most(abs(a) * frame.ray_error.x + abs(b) * frame.ray_error.y);
    float bound = 4.0f * error * (reach + error) + rounding + moved;
    // What overflows (eyes and vertices very far away) leaves everything in doubt.
    bool sane = bound < 1.0e28f && abs(det) < 1.0e34f;
    float scale = sane ? 1.0f / greater(abs(det), 1.0e-30f) : 0.0f;
    float orientation = det < 0.0f ? -1.0f : 1.0f;
    Setup setup;
    setup.a = sane ? orientation * a : vec3(0.0f);
    setup.b = sane ? orientation * b : vec3(0.0f);
    setup.c = sane ? orientation * c : vec3(0.0f);
    setup.c -= setup.a * middle.x + setup.b * middle.y;
    setup.bound = sane ? bound : 1.0e35f;

    // 1/z is that of the plane through the projected vertices, up to rounding; displacing the
    // vertices by `error` moves it by its gradient times that, while the displacement is small
    // against the triangle. Where it is not, nothing is certain.
    setup.q = vec3(setup.a.x + setup.a.y + setup.a.z, setup.b.x + setup.b.y + setup.b.z,
                   setup.c.x + setup.c.y + setup.c.z) * scale;
    vec2 slope = abs(setup.q.xy);
    float q_most = greater(setup.q.z + dot(slope, greater(frame.upper, -frame.lower)), 0.0f);
    // 2^-17; of det 2^-20 for products of size * size * z, nine of them.
    float c1 = 7.62939453125e-06f + 8.0f * error * (slope.x + slope.y) +
               9.5367431640625e-07f * size * size * z_size * scale;
    float c0 = 4.0f * rounding * scale + dot(slope, frame.ray_error);
    bool doubtful = !sane || 16.0f * error * size * z_size * scale >= 1.0f;
    setup.q_error = doubtful ? 1.0e35f : c0 + q_most * (c1 + q_most * frame.depth_error);
    return setup;
}

/// Of a leaf's triangles, given as bits, the first kLanes, one a lane.
struct Chunk {
    uint triangle;  // its slot in the leaf
    bool is_used;
    Setup setup;
};

Chunk set_up_chunk(uint alive) {
    uint rest = alive;
    [[unroll]] for (uint k = 0u; k < kLanes - 1u; ++k) {
        rest = lane > k ? rest & (rest - 1u) : rest;
    }
    Chunk chunk;
    chunk.is_used = rest != 0u;
    chunk.triangle = uint(findLSB(rest)) & 15u;
    uint from = chunk.triangle & (kLanes - 1u);
    uint words = read_lane(corner_words[0], from);
    [[unroll]] for (uint h = 1u; h < kSlots; ++h) {
        uint other = read_lane(corner_words[h], from);
        words = chunk.triangle / kLanes == h ? other : words;
    }
    chunk.setup = set_up_triangle(projected_triangle(words));
    return chunk;
}

/// The set-up of lane `from`, on all lanes.
Setup read_setup(Setup own, uint from) {
    return Setup(read_lane(own.a, from), read_lane(own.b, from), read_lane(own.c, from),
                 read_lane(own.q, from), read_lane(own.bound, from), read_lane(own.q_error, from));
}

// --- winners ---

/// A triangle by its leaf and its slot there, as packets keep it.
uint triangle_name(uint leaf, uint i) { return leaf * 16u + i; }
const uint kNoTriangle = 0xFFFFFFFFu;

vec3 leaf_vertex(uint leaf_at, uint slot) {
    return uintBitsToFloat(texelFetch(leaves, int(leaf_at + slot)).xyz);
}

uint named_triangle(uint name, out vec3 a, out vec3 b, out vec3 c) {
    uint i = name & 15u;
    uint at = (name >> 4u) * kLeafVec4s;
    uint corners = texelFetch(leaves, int(at + i)).w;
    a = leaf_vertex(at, corner(corners, 0u));
    b = leaf_vertex(at, corner(corners, 1u));
    c = leaf_vertex(at, corner(corners, 2u));
    return texelFetch(leaves, int(at + kLeafPrimIds + i / 4u))[i % 4u];
}

#endif  // SHADERS_PACKET_GLSL
