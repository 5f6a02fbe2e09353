// Packets of shared-origin rays over the shared layout, one packet a cluster of lanes. Lanes work
// in turn on a node's children, a leaf's vertices, its triangles, and rays.
//
// Based on: I. Wald, S. Boulos, P. Shirley. Ray Tracing Deformable Scenes Using Dynamic Bounding
// Volume Hierarchies. ACM TOG 26(1), 2007: packets far larger than a vector, one conservative test
// of the whole packet a node, ordered descent. Triangles are set up as homogeneous edge functions
// of the packet's own plane (M. Olano, T. Greer. Triangle scan conversion using 2D homogeneous
// coordinates. 1997), so that no vertex beside or behind the eye needs clipping.
//
// Edge functions and 1/z carry bounds of their distance from the results of the hit rule
// (common/interop/hit_rule.h). A triangle and a ray that are uncertain within these bounds are
// deferred to the rule. So a device may fuse and reorder all arithmetic but that of accurate_dot.
//
// Some devices mask branches instead of jumping over them, and run the body of a loop at least
// once. So loops here are nested such that each body has work most times it runs.
//
// The including file defines PACKET_HEIGHT in pixels, 8 or 16.
#ifndef SHADERS_PACKET_PACKET_GLSL
#define SHADERS_PACKET_PACKET_GLSL

#extension GL_EXT_control_flow_attributes : require

#include "common/interop/packet_bounds.h"
#include "common/interop/slab.h"
#include "common/interop/hit_rule.h"
#include "shaders/base/cluster.glsl"
#include "shaders/base/leaf.glsl"

layout(constant_id = kConstantStepBudget) const uint kSteps = kPacketStepBudget;

layout(binding = kBindNodes, rgba32ui) uniform readonly uimageBuffer nodes;

/// Stand for 1/z: the first for rays that are done, the second for boxes and triangles that reach
/// to the origin.
const float kDone = 1.0e38f;
const float kAnyDepth = 3.0e37f;
/// Stands for x of vertices that are not finite.
const float kFarAway = 1.0e36f;

/// The packet's projection: a point p relative to the origin has (x, y, z) = rows * p and the place
/// (x / z, y / z) in the packet's plane. Every ray has z > 0 and passes the plane within [lower,
/// upper].
struct PacketFrame {
    vec3 org;
    vec3 row_x;
    vec3 row_y;
    vec3 row_z;
    /// The row that this lane computes accurately (lane 0: x, 1: y, others: z), and its rounding
    /// error.
    vec3 own_row;
    vec3 own_row_error;
    /// Sums of the magnitudes of each row. row_shift times kExtentError covers the rounding of the
    /// products in row_x and row_y.
    vec3 row_size;
    float row_shift;
    vec2 lower;
    vec2 upper;
    /// Bound of the distance of a ray from the place that it is taken for, in x and y.
    vec2 ray_error;
    /// Bound of the distance by which the rule may place a hit nearer than exact, in z.
    float depth_error;
    /// Bound of the rounding of an edge function over the packet, relative to the size of its
    /// coefficients: kCameraRounding or kShadowRounding (proofs/packet_edges.g).
    float rounding;
};

PacketFrame frame;

/// A packet's rays lie in vectors of one ray a lane, 4 pixels wide and kVectorHeight high, 4
/// vectors in a row; and in groups of 8x4 rays, two groups in a row.
const uint kVectors = kPacketWidth * PACKET_HEIGHT / kLanes;
const uint kVectorHeight = kLanes / 4u;
const uint kGroups = PACKET_HEIGHT / 2u;
const uint kAllGroups = (1u << kGroups) - 1u;
const uint kGroupVectors = 32u / kLanes;

/// Rows of 4 vectors, and the vectors of the first row, as bits.
const uint kRows = kVectors / 4u;
const uint kFirstRow = 15u;

/// The k-th vector of a group, two in a row.
uint vector_of(uint group, uint k) {
    return 2u * (group & 1u) + (k & 1u) + 4u * (k >> 1u) + 2u * kGroupVectors * (group >> 1u);
}

/// (row + row_error) * (p + p_error), off by about 2^-44 of the sum of magnitudes (T. Ogita, S.
/// Rump, S. Oishi. Accurate sum and dot product. 2005, algorithm Dot2).
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

/// Bound of the coordinates of points of the scene relative to the origin.
float scene_reach() { return kSceneExtent + largest_component(frame.org); }

/// A packet's wedges are up to six planes through its origin and parallel to an axis of scene
/// space, two for each axis, with all rays on one side. They exclude boxes that the sides of a
/// rectangle of the plane do not, above all those that reach behind the origin beside the rays (S.
/// Gottschalk, M. Lin, D. Manocha. OBBTree: a hierarchical structure for rapid interference
/// detection. 1996, section 5).
///
/// Here are the factors of this lane's planes in sums over a box's planes: for the wedges, and for
/// the far end and the near end in z. With 4 lanes each lane has lower and upper planes; with more,
/// lanes 4 to 7 (12 to 15) have the upper ones.
const uint kWedges = 6u;
vec2 wedge_factors[kWedges];
vec2 other_wedge_factors[kWedges];
vec3 z_factors[2];
vec3 other_z_factors[2];
/// Bounds of the errors of the sums, including the reach of triangles out of their boxes.
float wedge_error;
float z_error;

/// A corner whose two coordinates are less than this part of the largest size is too near to the
/// axis for a wedge parallel to it.
const float kLeastSide = 9.094947017729282e-13f;  // 2^-40

/// Sets the wedges and ends for rays whose directions, scaled so that row_z * d = 1, are means of
/// `corners` but for their rounding. size: no sum of magnitudes that makes a component of a corner
/// is larger. least: the largest component of none of these directions is smaller.
///
/// In units of 2^-24 size, a direction is outside a wedge by at most 5.1 for the corners, 3.1 for
/// its own rounding (camera_direction), 1 for scaling, 6.1 for kCornerSlack and the test of a
/// corner, and 8.1 for the normal: less than the 32 of kWedgeRounding (proofs/packet_rectangles.g).
void set_planes(vec3 corners[4], float size, float least) {
    bool is_upper = kLanes >= 8u && (lane & 4u) != 0u;
    float unit = 1.0f / size;
    [[unroll]] for (uint a = 0u; a < 3u; ++a) {
        vec2 at[4];
        [[unroll]] for (uint k = 0u; k < 4u; ++k) {
            at[k] = unit * vec2(corners[k][(a + 1u) % 3u], corners[k][(a + 2u) % 3u]);
        }
        [[unroll]] for (uint s = 0u; s < 2u; ++s) {
            float side = s == 0u ? 1.0f : -1.0f;
            vec2 outermost = at[0];
            [[unroll]] for (uint k = 1u; k < 4u; ++k) {
                float inside = side * (outermost.x * at[k].y - outermost.y * at[k].x);
                outermost = inside < 0.0f ? at[k] : outermost;
            }
            float length = abs(outermost.x) + abs(outermost.y);
            bool is_wedge = length > kLeastSide;
            [[unroll]] for (uint k = 0u; k < 4u; ++k) {
                float inside = side * (outermost.x * at[k].y - outermost.y * at[k].x);
                is_wedge = is_wedge && inside >= -kCornerSlack * length;
            }
            vec2 normal = vec2(-outermost.y, outermost.x) * (side / (is_wedge ? length : 1.0f));
            normal = is_wedge ? normal : vec2(0.0f);
            vec2 farther = max(normal, vec2(0.0f));
            vec2 nearer = min(normal, vec2(0.0f));
            wedge_factors[2u * a + s] = is_upper ? farther : nearer;
            other_wedge_factors[2u * a + s] = is_upper ? nearer : farther;
        }
    }
    // The far end is the greatest z, the near end the least.
    vec3 farther = max(frame.row_z, vec3(0.0f));
    vec3 nearer = min(frame.row_z, vec3(0.0f));
    z_factors[0] = is_upper ? farther : nearer;
    other_z_factors[0] = is_upper ? nearer : farther;
    z_factors[1] = is_upper ? nearer : farther;
    other_z_factors[1] = is_upper ? farther : nearer;
    float reach = scene_reach();
    z_error = kBoxError * frame.row_size.z * reach;
    wedge_error = (kBoxError + kWedgeRounding * lesser(size / least, 1.0e9f)) * reach;
}

/// The children of the node visited last that are left to visit, for this lane: the key (bits of
/// 1/z at the child's nearest point, the slot in the last four; 0: no child) and the index of each.
uint keys[kSlots];
uint children[kSlots];
/// Keys and children of the nodes above.
const uint kLevelWords = (kSlots + 1u) / 2u;
uvec4 levels[kLevelWords * (kMaxDepth + 1u)];
uint level;

/// The least 1/z of the hits that the rays have, of all rays and of each group. Farther boxes and
/// triangles are culled.
float packet_q;
float group_q[kGroups];

void begin_traversal() {
    packet_q = 0.0f;
    [[unroll]] for (uint g = 0u; g < kGroups; ++g) group_q[g] = 0.0f;
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

/// Takes the nearest child that is left and not culled, or kEmptyChild.
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
    return uintBitsToFloat(imageLoad(nodes, int(at))) - vec4(org);
}

/// Bound of 1/z of the hits that the rule may find from `z` on.
float nearest_q(float z) {
    float near = z - frame.depth_error;
    return near > 1.0e-20f ? kNearestByDepth / near : kAnyDepth;
}

/// Sets keys and children to the children that the packet may meet. Lane l computes boxes 4 (l % 4)
/// to 4 (l % 4) + 3, and keeps kSlots of them.
void visit_node(uint node) {
    push_level();
    uint at = node * kNodeVec4s + (lane & 3u);
    uint half_at = kLanes >= 8u ? at + (lane & 4u) : at;
    vec4 x = fetch_planes(half_at + kNodeLowerX, frame.org.x);
    vec4 y = fetch_planes(half_at + kNodeLowerY, frame.org.y);
    vec4 z = fetch_planes(half_at + kNodeLowerZ, frame.org.z);
    vec4 planes[3] = vec4[3](x, y, z);
    vec4 inside[kWedges];
    vec4 ends[2];
    [[unroll]] for (uint i = 0u; i < kWedges; ++i) {
        inside[i] = planes[(i / 2u + 1u) % 3u] * wedge_factors[i].x +
                    planes[(i / 2u + 2u) % 3u] * wedge_factors[i].y;
    }
    [[unroll]] for (uint i = 0u; i < 2u; ++i) {
        ends[i] = x * z_factors[i].x + y * z_factors[i].y + z * z_factors[i].z;
    }
    if (kLanes >= 8u) {
        [[unroll]] for (uint i = 0u; i < kWedges; ++i) {
            inside[i] += subgroupShuffleXor(inside[i], 4u);
        }
        [[unroll]] for (uint i = 0u; i < 2u; ++i) ends[i] += subgroupShuffleXor(ends[i], 4u);
    } else {
        x = fetch_planes(at + kNodeUpperX, frame.org.x);
        y = fetch_planes(at + kNodeUpperY, frame.org.y);
        z = fetch_planes(at + kNodeUpperZ, frame.org.z);
        planes = vec4[3](x, y, z);
        [[unroll]] for (uint i = 0u; i < kWedges; ++i) {
            inside[i] += planes[(i / 2u + 1u) % 3u] * other_wedge_factors[i].x +
                         planes[(i / 2u + 2u) % 3u] * other_wedge_factors[i].y;
        }
        [[unroll]] for (uint i = 0u; i < 2u; ++i) {
            ends[i] +=
                x * other_z_factors[i].x + y * other_z_factors[i].y + z * other_z_factors[i].z;
        }
    }
    uvec4 child = imageLoad(nodes, int(at + kNodeChild));
    uint part = (lane >> 2u) * kSlots;
    [[unroll]] for (uint k = 0u; k < kSlots; ++k) {
        uint own = kLanes == 4u ? k : part + k;
        bool meets = child[own] != kEmptyChild;
        [[unroll]] for (uint i = 0u; i < kWedges; ++i) {
            meets = meets && inside[i][own] >= -wedge_error;
        }
        meets = meets && ends[0][own] >= -z_error;
        float q = nearest_q(ends[1][own] - z_error);
        meets = meets && q >= packet_q;
        uint slot = 4u * (lane & 3u) + own;
        keys[k] = meets ? (floatBitsToUint(q) & ~15u) | slot : 0u;
        children[k] = child[own];
    }
}

#endif  // SHADERS_PACKET_PACKET_GLSL
