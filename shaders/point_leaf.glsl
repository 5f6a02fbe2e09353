// The leaves that rays from one point meet. Triangles are sorted by edge functions of vertices
// relative to the point into those that a ray misses or hits for certain and those in doubt, which
// the rule is asked for, one of each lane at a time.
#ifndef SHADERS_POINT_LEAF_GLSL
#define SHADERS_POINT_LEAF_GLSL

#include "common/interop/triangle.h"
#include "shaders/point_rays.glsl"

layout(binding = kBindLeaves) uniform usamplerBuffer leaves;

/// Where floats leave a doubt: triangles and rays, a pair a lane, on the first doubt_count lanes.
uint doubt_name;
uint doubt_ray;
uint doubt_count;
/// Rays in doubt about this lane's triangles of a leaf that no lane has taken yet; none if there is
/// room.
uint doubtful_leaf;
uint doubtful[kSlots];

bool has_room() { return doubt_count < kLanes; }

float least(vec3 v) { return lesser(v.x, lesser(v.y, v.z)); }
float sum_of(vec3 v) { return abs(v.x) + abs(v.y) + abs(v.z); }

/// In place of coordinates that are not finite.
const float kFarAway = 1.0e30f;

struct Facing {
    // Edge functions of a direction d are d.n, positive inside for rays from the side of the point.
    vec3 n0;
    vec3 n1;
    vec3 n2;
    /// Least and largest coordinates relative to the point.
    vec3 lower;
    vec3 upper;
    /// Beyond this a direction is certain to be inside of an edge.
    float bound;
    /// How far below 0 d.n may be for a direction that goes through the triangle.
    float hit_bound;
    bool is_usable;
    /// Whether the point is certainly not in the triangle's plane.
    bool has_side;
};

vec3 corners_of(vec3 vertices[kSlots], uint slot) {
    uint from = slot & (kLanes - 1u);
    vec3 v = read_lane(vertices[0], from);
    [[unroll]] for (uint h = 1u; h < kSlots; ++h) {
        vec3 other = read_lane(vertices[h], from);
        v = slot / kLanes == h ? other : v;
    }
    return v;
}

/// For vertices a, b, c relative to the point, dir.z d.(b x c) is the edge function of the rule, in
/// exact arithmetic; n = b x c = b x (c - b), whose products are smaller. With s the largest |x| +
/// |y| + |z| of the vertices, l that of the edges at a added up, and directions d below 2 in each
/// component, what moves d.n is, in units of 2^-24,
/// - roundings: 4 l s of the edges, 12 l s of n and d.n;
/// - of a, b and c, each less than s, and what the rule displaces them by, 6 times how far they are
///   off the ray: 2 |d| times that, times how far the vertices are off the ray.
/// If the ray goes through the triangle, an edge is longer than that: 7 l s and 40 l^2. So d.n is
/// at least -2^-18 l (l + s) then. For any ray it is off by less than 2^-17 s^2 (64 s^2 of
/// roundings, as l <= 4 s; 4 s^2; 32 s^2); 2^-16 are taken. Likewise a.N, N = (b - a) x (c - a), is
/// the distance from the plane times |N|, and 2^-15 s |b - a| |c - a| is 8 times what displacements
/// and roundings can make of a point in the plane.
Facing facing_of(vec3 vertices[kSlots], uint words, bool is_triangle) {
    vec3 a = corners_of(vertices, corner(words, 0u));
    vec3 b = corners_of(vertices, corner(words, 1u));
    vec3 c = corners_of(vertices, corner(words, 2u));
    float size = greater(sum_of(a), greater(sum_of(b), sum_of(c)));
    vec3 e = b - a;
    vec3 f = c - a;
    float volume = dot(a, cross(e, f));
    float side = volume < 0.0f ? -1.0f : 1.0f;
    Facing t;
    t.n0 = side * cross(b, f - e);
    t.n1 = side * cross(f, a);
    t.n2 = side * cross(a, e);
    t.lower = min(a, min(b, c));
    t.upper = max(a, max(b, c));
    float length_e = sum_of(e);
    float length_f = sum_of(f);
    float edges = length_e + length_f;
    // 2^-16, 2^-18 and 2^-15.
    t.bound = 1.52587890625e-05f * size * size;
    t.hit_bound = 3.814697265625e-06f * edges * (edges + size);
    t.has_side = abs(volume) > 3.0517578125e-05f * size * length_e * length_f;
    t.is_usable = is_triangle && size < kFarAway;
    return t;
}

void visit_leaf(inout uint steps) {
    uint leaf = current & ~kLeafBit;
    vec3 vertices[kSlots];
    uint words[kSlots];
    [[unroll]] for (uint h = 0u; h < kSlots; ++h) {
        uvec4 texel = texelFetch(leaves, int(leaf * kLeafVec4s + h * kLanes + lane));
        vec3 v = uintBitsToFloat(texel.xyz);
        precise vec3 relative = v - org;
        vertices[h] = v.x <= kSceneExtent ? relative : vec3(kFarAway);
        words[h] = texel.w;
    }
    Facing triangles[kSlots];
    uint sure = 0u;
    doubtful_leaf = leaf;
    [[unroll]] for (uint h = 0u; h < kSlots; ++h) {
        bool is_triangle = h * kLanes + lane < corner_triangle_count(words[h]);
        triangles[h] = facing_of(vertices, words[h], is_triangle);
        doubtful[h] = 0u;
    }
    uint left = current_rays & alive;
    do {
        uint r = uint(findLSB(left)) & 15u;
        vec3 d = read_ray(dirs, r);
        float tfar = read_ray(tfars, r);
        vec3 sizes = abs(d);
        bool is_x = sizes.x >= sizes.y && sizes.x >= sizes.z;
        bool is_y = !is_x && sizes.y >= sizes.z;
        float dz = is_x ? d.x : is_y ? d.y : d.z;
        float reach = tfar * abs(dz);
        [[unroll]] for (uint h = 0u; h < kSlots; ++h) {
            float e0 = dot(d, triangles[h].n0);
            float e1 = dot(d, triangles[h].n1);
            float e2 = dot(d, triangles[h].n2);
            float low = lesser(e0, lesser(e1, e2));
            float high = greater(e0, greater(e1, e2));
            float lower = is_x   ? triangles[h].lower.x
                          : is_y ? triangles[h].lower.y
                                 : triangles[h].lower.z;
            float upper = is_x   ? triangles[h].upper.x
                          : is_y ? triangles[h].upper.y
                                 : triangles[h].upper.z;
            float nearest = dz < 0.0f ? -upper : lower;
            float farthest = dz < 0.0f ? -lower : upper;
            float bound = triangles[h].bound;
            float hit_bound = triangles[h].hit_bound;
            // A hit has a depth between those of the vertices.
            bool may_hit = triangles[h].is_usable && farthest > 0.0f &&
                           nearest <= 1.0001f * reach &&
                           (low >= -hit_bound || (!triangles[h].has_side && high <= hit_bound));
            bool does_hit = may_hit && triangles[h].has_side && low > bound &&
                            nearest >= farthest - nearest && farthest <= 0.9999f * reach;
            sure |= does_hit ? 1u << r : 0u;
            doubtful[h] |= may_hit && !does_hit ? 1u << r : 0u;
        }
        left &= left - 1u;
        ++steps;
    } while (left != 0u);
    alive &= ~cluster_or(sure);
}

vec3 leaf_vertex(uint leaf_at, uint slot) {
    return uintBitsToFloat(texelFetch(leaves, int(leaf_at + slot)).xyz);
}

/// The rule for the doubts, one of each lane.
void settle_doubts() {
    bool is_any = lane < doubt_count;
    uint name = is_any ? doubt_name : 0u;
    uint at = (name >> 4u) * kLeafVec4s;
    uint corners = texelFetch(leaves, int(at + (name & 15u))).w;
    TriangleHit hit;
    bool is_hit = intersect_triangle(
        shear_ray(org, read_ray(dirs, doubt_ray)), 0.0f, read_ray(tfars, doubt_ray),
        leaf_vertex(at, corner(corners, 0u)), leaf_vertex(at, corner(corners, 1u)),
        leaf_vertex(at, corner(corners, 2u)), hit);
    alive &= ~cluster_or(is_any && is_hit ? 1u << doubt_ray : 0u);
    doubt_count = 0u;
}

/// Hands what is doubtful to lanes, one pair after the other, as long as there is room.
void note_doubts(inout uint steps) {
    bool more = true;
    do {
        uint own = 0u;
        uint slot = 0u;
        [[unroll]] for (uint h = 0u; h < kSlots; ++h) {
            doubtful[h] &= alive;
            slot = own == 0u ? h : slot;
            own = own == 0u ? doubtful[h] : own;
        }
        uint lanes = cluster_or(own != 0u ? 1u << lane : 0u);
        bool is_any = lanes != 0u && has_room();
        uint from = uint(findLSB(lanes)) & (kLanes - 1u);
        uint ray = uint(findLSB(read_lane(own, from))) & 15u;
        uint name = doubtful_leaf * 16u + read_lane(slot, from) * kLanes + from;
        bool is_taker = is_any && lane == doubt_count;
        doubt_name = is_taker ? name : doubt_name;
        doubt_ray = is_taker ? ray : doubt_ray;
        uint any = 0u;
        [[unroll]] for (uint h = 0u; h < kSlots; ++h) {
            bool is_given = is_any && lane == from && h == slot;
            doubtful[h] = is_given ? doubtful[h] & (doubtful[h] - 1u) : doubtful[h];
            any |= doubtful[h];
        }
        doubt_count += is_any ? 1u : 0u;
        more = cluster_or(any) != 0u;
        ++steps;
    } while (more && has_room());
}

#endif  // SHADERS_POINT_LEAF_GLSL
