// The leaves that neighbouring rays meet. Edge functions of a ray's direction and moment, relative
// to the origin of one of the rays, sort triangles into missed, surely hit and uncertain ones. The
// rule resolves uncertain ones, one of each lane at a time.
#ifndef SHADERS_OCCLUSION_NEAR_LEAF_GLSL
#define SHADERS_OCCLUSION_NEAR_LEAF_GLSL

#include "common/interop/packet_bounds.h"
#include "common/interop/hit_rule.h"
#include "shaders/base/leaf.glsl"
#include "shaders/occlusion/near_rays.glsl"

/// Deferred pairs of a triangle and a ray, one on each of the first deferred_count lanes.
uint deferred_name;
uint deferred_ray;
uint deferred_count;
/// The rays that are uncertain for this lane's triangles of a leaf and that no lane has taken; 0 if
/// there is room.
uint uncertain_leaf;
uint uncertain[kSlots];

bool has_room() { return deferred_count < kLanes; }

float sum_of(vec3 v) { return abs(v.x) + abs(v.y) + abs(v.z); }
float largest_of(vec3 v) { return greater(abs(v.x), greater(abs(v.y), abs(v.z))); }

/// Stands for coordinates that are not finite.
const float kFarAway = 1.0e30f;

/// The origin of coordinates in leaves, and the largest |x| + |y| + |z| of ray origins relative to
/// it.
vec3 centre;
float spread;

/// A triangle a, b, c, relative to the centre, with e = b - a and f = c - a. The edge functions of
/// a ray from org in the direction d, such as (b - org) x (c - org) . d, are d . (b x c) + (org x
/// d) . (c - b) and so on; in exact arithmetic they are those of the rule times a factor.
///
/// 1. Let s be the largest |x| + |y| + |z| of a, b and c, w that of all org (`spread`), S = s + w,
///    l the sum of those of e and f. The components of d are below 2. Errors are in units of 2^-24.
/// 2. Roundings of the first edge function: 4 l s of the edges, 4 l s of b x c, 6 l s of its
///    product with d; 6 w l of org and org x d, 10 w l of its products, 2 w l of their difference;
///    2 l S of the sum. The second has no more, the sum of all three 4 l^2. So the third, with two
///    subtractions, has at most 42 l S + 5 l^2.
/// 3. The errors of a, b and c are each less than s, and the rule displaces them by 6 times their
///    distance from the ray. They move an edge function by 2 |d| times that, times the distance of
///    the vertices from the ray. If the ray goes through the triangle, an edge is longer than that
///    distance: 7 l s and 42 l^2.
/// 4. So if all three are beyond 128 l (l + S) and of one sign, the ray goes through the triangle,
///    with 79 l S + 81 l^2 to spare, and hence through the displaced one.
/// 5. a.N - org.N, N = e x f, is the ray's distance from the plane times |N|, and off by less than
///    13 S |e| |f|. If it is beyond 64 S |e| |f| and the rule has a hit, the plane is met in front
///    (cpu/single_ray/shared_leaf-inl.h, "Behind the origin"). Then the sum of the three has its
///    sign. Those of the displaced triangle have one sign, so none of the three has the other sign
///    by more than 2 (7 l S + 42 l^2) and the roundings, which is less than 128 l (l + S) again.
/// 6. A ray that certainly goes through the triangle meets the plane at t = (a.N - org.N) / d.N.
///    The depths of the vertices differ from t by at most `extent`, and d.N, the sum of the three,
///    is off by less than `bound`. A depth of the rule is a mean of those of the vertices: it is
///    certain if they have one sign and differ by no more than the least of them, and within reach
///    if the farthest is.
struct Facing {
    vec3 e;
    vec3 f;
    /// b x c, c x a, and the sum of these and a x b.
    vec3 bc;
    vec3 ca;
    vec3 normal;
    /// a . normal
    float height;
    /// An edge function beyond this has a certain sign.
    float bound;
    /// A ray whose height is beyond this certainly starts on one side of the plane.
    float side_bound;
    /// The largest component of an edge.
    float extent;
    bool is_usable;
};

vec3 read_vertex(vec3 vertices[kSlots], uint slot) {
    uint from = slot & (kLanes - 1u);
    vec3 v = read_lane(vertices[0], from);
    [[unroll]] for (uint h = 1u; h < kSlots; ++h) {
        vec3 other = read_lane(vertices[h], from);
        v = slot / kLanes == h ? other : v;
    }
    return v;
}

Facing facing_of(vec3 vertices[kSlots], uint indices, bool is_triangle) {
    vec3 a = read_vertex(vertices, corner(indices, 0u));
    vec3 b = read_vertex(vertices, corner(indices, 1u));
    vec3 c = read_vertex(vertices, corner(indices, 2u));
    float size = greater(sum_of(a), greater(sum_of(b), sum_of(c)));
    Facing t;
    t.e = b - a;
    t.f = c - a;
    t.bc = cross(b, t.f - t.e);
    t.ca = cross(t.f, a);
    t.normal = cross(t.e, t.f);
    t.height = dot(a, t.normal);
    float length_e = sum_of(t.e);
    float length_f = sum_of(t.f);
    float edges = length_e + length_f;
    t.bound = kNearEdgeError * edges * (edges + size + spread);
    t.side_bound = kNearSideError * (size + spread) * length_e * length_f;
    t.extent = greater(largest_of(t.e), greater(largest_of(t.f), largest_of(t.f - t.e)));
    t.is_usable = is_triangle && size < kFarAway;
    return t;
}

/// Whether a ray may hit a triangle, and whether it certainly does.
void sort_hit(Facing t, vec3 org, vec3 dir, vec3 moment, float tfar, out bool may_hit,
              out bool does_hit) {
    float along_e = dot(moment, t.e);
    float along_f = dot(moment, t.f);
    float total = dot(dir, t.normal);
    float e0 = dot(dir, t.bc) + (along_f - along_e);
    float e1 = dot(dir, t.ca) - along_f;
    float e2 = total - e0 - e1;
    float height = t.height - dot(org, t.normal);
    bool has_side = abs(height) > t.side_bound;
    // Makes edge functions positive inside for rays that meet the plane in front.
    float side = height < 0.0f ? -1.0f : 1.0f;
    float low = lesser(side * e0, lesser(side * e1, side * e2));
    float high = greater(side * e0, greater(side * e1, side * e2));
    may_hit = t.is_usable && (low >= -t.bound || (!has_side && high <= t.bound));
    does_hit = may_hit && has_side && low > t.bound &&
               abs(height) >= 2.0f * t.extent * (side * total + t.bound) &&
               abs(height) + t.side_bound <=
                   (0.9999f * tfar - t.extent) * (side * total - t.bound);
}

void visit_leaf(inout uint steps) {
    uint leaf = current & ~kLeafBit;
    vec3 vertices[kSlots];
    uint indices[kSlots];
    [[unroll]] for (uint h = 0u; h < kSlots; ++h) {
        uvec4 texel = imageLoad(leaves, int(leaf * kLeafVec4s + h * kLanes + lane));
        vec3 v = uintBitsToFloat(texel.xyz);
        vertices[h] = v.x <= kSceneExtent ? v - centre : vec3(kFarAway);
        indices[h] = texel.w;
    }
    Facing triangles[kSlots];
    uint sure = 0u;
    uncertain_leaf = leaf;
    [[unroll]] for (uint h = 0u; h < kSlots; ++h) {
        bool is_triangle = h * kLanes + lane < corner_triangle_count(indices[h]);
        triangles[h] = facing_of(vertices, indices[h], is_triangle);
        uncertain[h] = 0u;
    }
    uint left = current_rays & alive;
    steps += 1u + uint(bitCount(left));
    do {
        uint r = uint(findLSB(left)) & (kPacketRays - 1u);
        vec3 d = read_ray(dirs, r);
        vec3 org = read_ray(orgs, r) - centre;
        float tfar = read_ray(tfars, r);
        vec3 moment = cross(org, d);
        [[unroll]] for (uint h = 0u; h < kSlots; ++h) {
            bool may_hit, does_hit;
            sort_hit(triangles[h], org, d, moment, tfar, may_hit, does_hit);
            sure |= does_hit ? 1u << r : 0u;
            uncertain[h] |= may_hit && !does_hit ? 1u << r : 0u;
        }
        left &= left - 1u;
    } while (left != 0u);
    alive &= ~cluster_or(sure);
}

/// Applies the rule to the deferred pairs, one of each lane.
void resolve_deferred() {
    bool is_any = lane < deferred_count;
    uint name = is_any ? deferred_name : 0u;
    vec3 a, b, c;
    leaf_triangle((name >> 4u) * kLeafVec4s, name & 15u, a, b, c);
    TriangleHit hit;
    bool is_hit = intersect_triangle(
        shear_ray(read_ray(orgs, deferred_ray), read_ray(dirs, deferred_ray)), 0.0f,
        read_ray(tfars, deferred_ray), a, b, c, hit);
    alive &= ~cluster_or(is_any && is_hit ? 1u << deferred_ray : 0u);
    deferred_count = 0u;
}

/// Gives uncertain pairs to lanes, one after the other, as long as there is room.
void note_uncertain(inout uint steps) {
    bool more = true;
    do {
        uint own = 0u;
        uint slot = 0u;
        [[unroll]] for (uint h = 0u; h < kSlots; ++h) {
            uncertain[h] &= alive;
            slot = own == 0u ? h : slot;
            own = own == 0u ? uncertain[h] : own;
        }
        uint lanes = cluster_or(own != 0u ? 1u << lane : 0u);
        bool is_any = lanes != 0u && has_room();
        uint from = uint(findLSB(lanes)) & (kLanes - 1u);
        uint ray = uint(findLSB(read_lane(own, from))) & (kPacketRays - 1u);
        uint name = uncertain_leaf * 16u + read_lane(slot, from) * kLanes + from;
        bool is_taker = is_any && lane == deferred_count;
        deferred_name = is_taker ? name : deferred_name;
        deferred_ray = is_taker ? ray : deferred_ray;
        uint any = 0u;
        [[unroll]] for (uint h = 0u; h < kSlots; ++h) {
            bool is_given = is_any && lane == from && h == slot;
            uncertain[h] = is_given ? uncertain[h] & (uncertain[h] - 1u) : uncertain[h];
            any |= uncertain[h];
        }
        deferred_count += is_any ? 1u : 0u;
        more = cluster_or(any) != 0u;
        ++steps;
    } while (more && has_room());
}

#endif  // SHADERS_OCCLUSION_NEAR_LEAF_GLSL
