// Sets up triangles as edge functions and 1/z in the packet's plane, with bounds of all errors
// (docs/design/arithmetic.md, "Packets"). cpu/packet/triangle_setup-inl.h does the same.
#ifndef SHADERS_PACKET_TRIANGLE_SETUP_GLSL
#define SHADERS_PACKET_TRIANGLE_SETUP_GLSL

#include "common/interop/packet_bounds.h"
#include "shaders/packet/depth_bounds.glsl"
#include "shaders/packet/packet_leaf.glsl"

/// The largest |X| or |Y| of a ray of the packet.
float plane_reach() {
    vec2 reach = greater(frame.upper, -frame.lower);
    return greater(reach.x, reach.y);
}

/// Edge functions a x + b y + c in the packet's plane, positive inside, and the bound of their
/// errors; 1/z = q.x x + q.y y + q.z, and the bound of its error.
struct Setup {
    vec3 a;
    vec3 b;
    vec3 c;
    vec3 q;
    float bound;
    float q_error;
    /// q_error, or kDone if it is too large for a certain hit.
    float sure_error;
    /// The edge functions have one sign inside, but either.
    bool is_unoriented;
};

/// A triangle relative to the ray at `middle`.
struct CentredTriangle {
    ProjectedTriangle vertices;
    vec2 middle;
    /// The largest |x| + |y|; the largest range of x or y; and a bound of |x| + |y| of a vertex
    /// relative to a ray through the triangle.
    float size;
    float edge;
    float hit_reach;
    float z_least;
    float z_size;
    float z_range;
    /// Bound of the summed errors of x and y, relative to the vertices displaced by the rule.
    float error;
    /// The part of it that grows with extent and distance.
    float leaf_error;
    /// The cross product of two edges; its product with a vertex, which is 6 times the signed
    /// volume of triangle and origin; and the bound of the error of that relative to a hit of the
    /// rule.
    vec3 normal;
    float volume;
    float volume_error;
    bool in_front;
};

/// Relative to any ray an edge is at most 2 edge long, plus the distance to that ray times its
/// range of z. The rounding of the normal is 8 u edge (z_range, z_range, edge), so that of the
/// volume is 16 u edge (2 z_range size + edge z_size).
CentredTriangle centre_triangle(ProjectedTriangle t, float triangle_error) {
    CentredTriangle s;
    s.z_least = least(t.z);
    s.z_size = most(abs(t.z));
    s.z_range = most(t.z) - s.z_least;
    s.leaf_error = triangle_error;
    s.in_front = is_in_front(s.z_least, s.z_size, triangle_error);
    float rz = t.z.x > 0.0f ? 1.0f / t.z.x : 0.0f;
    s.middle = clamp(vec2(t.x.x, t.y.x) * rz, frame.lower, frame.upper);
    vec3 px = t.x - s.middle.x * t.z;
    vec3 py = t.y - s.middle.y * t.z;
    s.vertices = ProjectedTriangle(px, py, t.z);
    s.size = most(abs(px) + abs(py));
    s.edge = greater(most(px) - least(px), most(py) - least(py));
    vec2 span = frame.upper - frame.lower;
    s.error = kLateralError * s.size + kShearError * plane_reach() * s.z_size + triangle_error;
    s.hit_reach = lesser(s.size + (span.x + span.y) * s.z_size,
                         2.0f * s.edge + (span.x + span.y) * s.z_range) + s.error;
    vec3 e = vec3(px.y, py.y, t.z.y) - vec3(px.x, py.x, t.z.x);
    vec3 f = vec3(px.z, py.z, t.z.z) - vec3(px.x, py.x, t.z.x);
    s.normal = cross(e, f);
    s.volume = s.normal.x * px.x + s.normal.y * py.x + s.normal.z * t.z.x;
    float z_error = kDepthError * s.z_size + triangle_error * directions.depth_share;
    s.volume_error =
        s.hit_reach * (kVolumeError * s.error * s.z_size + 3.0f * s.hit_reach * z_error) +
        kDeviceVolumeRounding * s.edge * (2.0f * s.z_range * s.size + s.edge * s.z_size);
    return s;
}

/// Sets q and its errors. q is unknown if |volume| is at most kLeastVolume, or at most kKnownVolume
/// times its error.
///
/// 1. The plane of the float vertices is n.(x, y, 1) / n.p in 1/z.
/// 2. The weights of a hit give a point of this plane that is at most `error` from the ray, and off
///    in z by the part of z in leaf_error.
/// 3. Roundings of n are `rounding` relative to 1/z, and half as much over a ray of the packet, but
///    for the part of z_range.
/// 4. The sum over x and y takes some 20 roundings, with |x|, |y| <= 17 (beyond that ray_error is
///    as large).
/// 5. The error is taken at q_most, which is at least q of any ray with what 4. rounds, so neither
///    has a second order (proofs/packet_depth.g).
void set_up_depth(inout Setup setup, CentredTriangle t) {
    float scale = 1.0f / greater(abs(t.volume), kLeastVolume);
    setup.q = t.normal * (t.volume < 0.0f ? -scale : scale);
    setup.q.z -= setup.q.x * t.middle.x + setup.q.y * t.middle.y;
    vec2 slope = abs(setup.q.xy);
    vec2 reach = greater(frame.upper, -frame.lower) + vec2(kDeviceSlopeRounding);
    float q_most = greater(setup.q.z + dot(slope, reach), 0.0f);
    q_most = t.in_front ? lesser(q_most, 1.001f / t.z_least) : q_most;

    vec2 span = frame.upper - frame.lower;
    float longest = 2.0f * t.edge + (span.x + span.y) * t.z_range;
    Extents extents = Extents(t.size, t.edge, longest, t.z_range, t.z_size, t.error, scale);
    RuleDepth rule = rule_depth(extents, q_most, t.leaf_error * directions.depth_share);
    float by_q2 = t.in_front ? rule.by_q2 : kRuleDepthFactor * frame.depth_error;
    float edge_rounding = 0.5f * kDeviceRounding * t.edge * scale;
    float rounding = edge_rounding * (4.0f * t.z_range * t.size + 2.0f * t.edge * t.z_size);
    slope += vec2(2.0f * edge_rounding * t.z_range);
    float c0 = dot(slope, frame.ray_error + vec2(kDeviceSlopeRounding)) +
               edge_rounding * (span.x + span.y) * t.z_range;
    float c1 = kReciprocalRounding + kSteepError * t.error * (slope.x + slope.y) + rounding +
               (t.in_front ? rule.by_q : 0.0f);
    bool is_known = setup.bound < 1.0e28f && abs(t.volume) > kKnownVolume * t.volume_error &&
                    abs(t.volume) > kLeastVolume && rounding < 0.03125f &&
                    q_most * by_q2 <= kFarDepth;
    setup.q = is_known ? setup.q : vec3(0.0f);
    setup.q_error = is_known ? c0 + q_most * (c1 + q_most * by_q2) : 1.0e35f;
    // Steep triangles give no certain hit, since their error would become that of all hits: 2^-10.
    setup.sure_error = setup.q_error <= 9.765625e-04f * q_most ? setup.q_error : kDone;
}

/// Edge functions are computed relative to the point of the packet nearest to the first vertex.
///
/// 1. `reach` bounds |x| and |y| of the vertices relative to any ray of the packet, so an edge
///    function moves by at most 2 error reach + error^2.
/// 2. Its own roundings are at most frame.rounding size z_size + kEdgeRounding size^2.
/// 3. If the sign of the volume is certain, it is that of the edge functions of a hit.
/// 4. Otherwise they may have either sign. Their sum is the volume by z, with z no nearer than a
///    vertex; so a larger bound covers both signs if all vertices are well in front of the origin.
/// 5. If they are not, the triangle is unoriented: two functions beyond their bound with opposite
///    signs exclude a ray.
/// 6. If a value overflows, the triangle is unknown: uncertain for every ray.
Setup set_up_triangle(ProjectedTriangle triangle, float triangle_error) {
    CentredTriangle t = centre_triangle(triangle, triangle_error);
    vec3 px = t.vertices.x;
    vec3 py = t.vertices.y;
    vec3 z = t.vertices.z;
    vec2 span = frame.upper - frame.lower;
    float reach = greater(span.x, span.y) * t.z_size + t.size;
    float rounding = t.size * (frame.rounding * t.z_size + kEdgeRounding * t.size);
    vec3 a = py.yzx * z.zxy - z.yzx * py.zxy;
    vec3 b = z.yzx * px.zxy - px.yzx * z.zxy;
    vec3 c = px.yzx * py.zxy - py.yzx * px.zxy;
    float moved = most(abs(a) * frame.ray_error.x + abs(b) * frame.ray_error.y);
    float bound = 2.0f * t.error * (reach + t.error) + rounding + moved;
    bool is_oriented = abs(t.volume) > t.volume_error;
    float either_sign = kEitherSign * t.volume_error / greater(t.z_least, 1.0e-20f);
    bound += is_oriented || !t.in_front ? 0.0f : either_sign;
    bool is_known = bound < 1.0e28f && abs(t.volume) < kMostVolume;
    float orientation = t.volume < 0.0f ? -1.0f : 1.0f;
    Setup setup;
    setup.a = is_known ? orientation * a : vec3(0.0f);
    setup.b = is_known ? orientation * b : vec3(0.0f);
    setup.c = is_known ? orientation * c : vec3(0.0f);
    setup.c -= setup.a * t.middle.x + setup.b * t.middle.y;
    setup.bound = is_known ? bound : 1.0e35f;
    setup.is_unoriented = is_known && !is_oriented && !t.in_front;
    set_up_depth(setup, t);
    return setup;
}

/// The groups with a ray that may hit a triangle, as bits: somewhere in the group's rectangle each
/// edge function reaches its bound, and 1/z is not surely less than that of all its hits. The
/// maximum over a rectangle is the sum for a ray at its corner with three more roundings, of values
/// up to 32 times the coefficients; frame.rounding is 1.8 times the need of rays and covers these.
/// Unoriented triangles: the same, or each function reaches its bound from above. Rounding is
/// symmetric.
uint met_groups(Setup s, bool on_grid) {
    vec3 reach = s.c + s.bound;
    vec3 other_reach = s.bound - s.c;
    float q_reach = s.q.z + s.q_error;
    uint groups = 0u;
    if (on_grid) {
        // The outermost middles of 8x4 pixels are 3.5 and 1.5 from the middle of the group.
        vec3 half_extent = 3.5f * abs(s.a) + 1.5f * abs(s.b);
        reach += half_extent;
        other_reach += half_extent;
        q_reach += 3.5f * abs(s.q.x) + 1.5f * abs(s.q.y);
    }
    [[unroll]] for (uint g = 0u; g < kGroups; ++g) {
        vec3 e;
        vec3 other;
        float q;
        if (on_grid) {
            float x = (g & 1u) == 0u ? -4.0f : 4.0f;
            float y = 4.0f * float(g >> 1u) + 2.0f - float(kGroups);
            e = reach + x * s.a + y * s.b;
            other = other_reach - x * s.a - y * s.b;
            q = q_reach + x * s.q.x + y * s.q.y;
        } else {
            vec2 l = group_lower[g];
            vec2 u = group_upper[g];
            e = reach + greater(s.a * l.x, s.a * u.x) + greater(s.b * l.y, s.b * u.y);
            other = other_reach - lesser(s.a * l.x, s.a * u.x) - lesser(s.b * l.y, s.b * u.y);
            q = q_reach + greater(s.q.x * l.x, s.q.x * u.x) + greater(s.q.y * l.y, s.q.y * u.y);
        }
        bool is_met = least(e) >= 0.0f || (s.is_unoriented && least(other) >= 0.0f);
        groups |= is_met && q >= group_q[g] ? 1u << g : 0u;
    }
    return groups;
}

/// Leaves an unoriented triangle to the rule, for all rays of the groups that it meets.
void leave_to_rule(inout Setup s) {
    s.a = s.is_unoriented ? vec3(0.0f) : s.a;
    s.b = s.is_unoriented ? vec3(0.0f) : s.b;
    s.c = s.is_unoriented ? vec3(0.0f) : s.c;
    s.bound = s.is_unoriented ? 1.0e35f : s.bound;
}

/// Returns the set-up of lane `from` on all lanes, for a triangle with an orientation.
Setup read_setup(Setup own, uint from) {
    return Setup(read_lane(own.a, from), read_lane(own.b, from), read_lane(own.c, from),
                 read_lane(own.q, from), read_lane(own.bound, from), read_lane(own.q_error, from),
                 read_lane(own.sure_error, from), false);
}

#endif  // SHADERS_PACKET_TRIANGLE_SETUP_GLSL
