// The leaves of a packet: their triangles culled, then set up with the bounds of every error.
#ifndef SHADERS_PACKET_LEAF_GLSL
#define SHADERS_PACKET_LEAF_GLSL

#include "common/interop/packet_bounds.h"
#include "shaders/packet_depth.glsl"

/// The leaf's vertices, projected; x is kFarAway where they are not finite.
vec3 projected[kSlots];
/// Corners of its triangles.
uint corner_words[kSlots];
/// How far x, y and z of a projected vertex, displaced as the rule does, may be off in all.
float leaf_error;

/// What a step in x, y and z of scene space adds to x - X z and y - Y z together, at most, for |X|,
/// |Y| up to 17 (or else ray_error is as large).
float row_sizes() {
    return frame.row_size.x + frame.row_size.y + 34.0f * frame.row_size.z + frame.row_shift;
}

/// The largest |X| or |Y| of a ray of the packet.
float plane_reach() {
    vec2 reach = greater(frame.upper, -frame.lower);
    return greater(reach.x, reach.y);
}

/// The reference, the leaf's first vertex, is projected accurately; the others by rows * (v -
/// reference), off by at most 6 u row_size extent and 2 u of the result (docs/design/arithmetic.md,
/// "Packets").
void project_vertices(uint leaf) {
    vec3 v[kSlots];
    [[unroll]] for (uint h = 0u; h < kSlots; ++h) {
        uvec4 words = imageLoad(leaves, int(leaf * kLeafVec4s + h * kLanes + lane));
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
    leaf_error = row_sizes() * (kExtentError * extent +
                                (kDistanceError * largest_component(p) + kGridError)) +
                 kPlaneFloor;
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

/// Of rays that are not the middles of pixels, the rectangles of each group.
vec2 group_lower[kGroups];
vec2 group_upper[kGroups];

/// Whether a triangle is certainly in front of the origin, so far that it may be projected.
bool is_in_front(float z_least, float z_size, float error) {
    return z_least > 0.0009765625f * z_size + 16.0f * error;
}

/// The groups of rays that a triangle may concern, as bits: its rectangle meets theirs, and covers
/// the middle of a pixel if the rays are those (on_grid); and it is in front of the origin, nearer
/// than what all rays have found.
uint concerned_groups(Corners t, bool on_grid) {
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
        // Most small triangles cover no pixel's middle, x = k + 0.5 for whole k, at all.
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

/// Of the leaf's triangles, the groups that each may concern.
uint triangle_groups[kSlots];

/// The triangles of a leaf that may concern the packet, as bits. Leaves projected, corner_words,
/// leaf_error and triangle_groups.
uint cull_leaf(uint leaf, bool on_grid) {
    project_vertices(leaf);
    uint alive = 0u;
    [[unroll]] for (uint h = 0u; h < kSlots; ++h) {
        uint words = corner_words[h];
        uint i = lane + kLanes * h;
        uint groups = concerned_groups(projected_triangle(words), on_grid);
        triangle_groups[h] = i < corner_triangle_count(words) ? groups : 0u;
        alive |= triangle_groups[h] != 0u ? 1u << i : 0u;
    }
    return cluster_or(alive);
}

/// Edge functions a x + b y + c of the packet's plane, positive inside; their bound; 1/z likewise
/// as a function of x and y, and its bound.
struct Setup {
    vec3 a;
    vec3 b;
    vec3 c;
    vec3 q;
    float bound;
    float q_error;
    /// q_error, or kDone where it is too large for a hit to be certain.
    float win_error;
};

/// A triangle as the ray at `middle` sees it.
struct SeenTriangle {
    Corners corners;
    vec2 middle;
    /// The largest |x| + |y|; the largest range of x or y; and |x| + |y| of a vertex as a ray sees
    /// it that goes through the triangle, at most.
    float size;
    float edge;
    float hit_reach;
    float z_least;
    float z_size;
    float z_range;
    /// How far x and y may be off together from those of the vertices that the rule displaces.
    float error;
    /// Of that, what grows with the extent and the distance.
    float leaf_error;
    /// The cross product of two edges, its product with a vertex (6 times the volume that the
    /// triangle and the origin span, with its sign), and how far that may be off from what a hit of
    /// the rule sees.
    vec3 normal;
    float volume;
    float volume_error;
    bool in_front;
};

/// Edges are as long for a ray through the triangle as for any: 2 edge, and the way to that ray
/// times their range of z. The rounding of the normal is 8 u edge (z_range, z_range, edge), which
/// makes 16 u edge (2 z_range size + edge z_size) of the volume.
SeenTriangle see_triangle(Corners t, float triangle_error) {
    SeenTriangle s;
    s.z_least = least(t.z);
    s.z_size = most(abs(t.z));
    s.z_range = most(t.z) - s.z_least;
    s.leaf_error = triangle_error;
    s.in_front = is_in_front(s.z_least, s.z_size, triangle_error);
    float rz = t.z.x > 0.0f ? 1.0f / t.z.x : 0.0f;
    s.middle = clamp(vec2(t.x.x, t.y.x) * rz, frame.lower, frame.upper);
    vec3 px = t.x - s.middle.x * t.z;
    vec3 py = t.y - s.middle.y * t.z;
    s.corners = Corners(px, py, t.z);
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
    s.volume_error = s.hit_reach * (kVolumeError * s.error * s.z_size + 3.0f * s.hit_reach * z_error) +
                     kDeviceVolumeRounding * s.edge *
                         (2.0f * s.z_range * s.size + s.edge * s.z_size);
    return s;
}

/// q and its errors. Where |volume| is not more than kKnownVolume times its error nothing is known of q.
///
/// The plane of the float vertices is n.(x, y, 1) / n.p in 1/z. The weights of a hit, taken of
/// these vertices, give a point of the plane that is `error` from the ray at most, and off in z by
/// z's part of leaf_error. Then there are roundings: of n, which make `rounding` relative to 1/z,
/// and over a ray of the packet half as much, but for what is z_range's; and of the sum over x and
/// y, with |x|, |y| <= 17 (or else ray_error is as large) in some 20 steps.
void set_up_depth(inout Setup setup, SeenTriangle t) {
    float scale = 1.0f / greater(abs(t.volume), 1.0e-30f);
    setup.q = t.normal * (t.volume < 0.0f ? -scale : scale);
    setup.q.z -= setup.q.x * t.middle.x + setup.q.y * t.middle.y;
    vec2 slope = abs(setup.q.xy);
    float q_most = greater(setup.q.z + dot(slope, greater(frame.upper, -frame.lower)), 0.0f);
    q_most = t.in_front ? lesser(q_most, 1.001f / t.z_least) : q_most;

    vec2 span = frame.upper - frame.lower;
    float longest = 2.0f * t.edge + (span.x + span.y) * t.z_range;
    Extents extents = Extents(t.size, t.edge, longest, t.z_range, t.z_size, t.error, scale);
    RuleDepth rule = rule_depth(extents, q_most, t.leaf_error * directions.depth_share);
    float by_q2 = t.in_front ? rule.by_q2 : kRuleDepthFactor * frame.depth_error;
    // 2^-20.
    float edge_rounding = 9.5367431640625e-07f * t.edge * scale;
    float rounding = edge_rounding * (4.0f * t.z_range * t.size + 2.0f * t.edge * t.z_size);
    slope += vec2(2.0f * edge_rounding * t.z_range);
    // 2^-15.
    float c0 = dot(slope, frame.ray_error + vec2(3.0517578125e-05f)) +
               edge_rounding * (span.x + span.y) * t.z_range;
    float c1 = kReciprocalRounding + kSteepError * t.error * (slope.x + slope.y) + rounding +
               (t.in_front ? rule.by_q : 0.0f);
    bool is_known = setup.bound < 1.0e28f && abs(t.volume) > kKnownVolume * t.volume_error &&
                    rounding < 0.03125f && q_most * by_q2 <= kFarDepth;
    setup.q = is_known ? setup.q : vec3(0.0f);
    setup.q_error = is_known ? c0 + q_most * (c1 + q_most * by_q2) : 1.0e35f;
    // Steep triangles, whose error would be that of all that were hit: 2^-10.
    setup.win_error = setup.q_error <= 9.765625e-04f * q_most ? setup.q_error : kDone;
}

/// Edge functions are taken in the point of the packet nearest to the first vertex. `reach` bounds
/// both |x| and |y| of the vertices as seen from any ray of the packet, so that an edge function
/// moves by at most 2 error reach + error^2. Its own roundings are at most frame.rounding size
/// z_size + 16 u size^2.
///
/// The sign of the volume is that of the edge functions of a hit where it is certain. Elsewhere they
/// may have either sign, and add up to the volume by z, with z no nearer than a vertex; so a larger
/// bound covers both signs where all vertices are well in front of the origin. Where they are not,
/// and where something overflows, nothing is known of the triangle: the rule is asked for every
/// ray. As in cpu/packet_setup-inl.h.
Setup set_up_triangle(Corners corners, float triangle_error) {
    SeenTriangle t = see_triangle(corners, triangle_error);
    vec3 px = t.corners.x;
    vec3 py = t.corners.y;
    vec3 z = t.corners.z;
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
    bound += is_oriented ? 0.0f : either_sign;
    bool is_known =
        (is_oriented || t.in_front) && bound < 1.0e28f && abs(t.volume) < 1.0e34f;
    float orientation = t.volume < 0.0f ? -1.0f : 1.0f;
    Setup setup;
    setup.a = is_known ? orientation * a : vec3(0.0f);
    setup.b = is_known ? orientation * b : vec3(0.0f);
    setup.c = is_known ? orientation * c : vec3(0.0f);
    setup.c -= setup.a * t.middle.x + setup.b * t.middle.y;
    setup.bound = is_known ? bound : 1.0e35f;
    set_up_depth(setup, t);
    return setup;
}

/// The groups of which some ray may hit a triangle, as bits: somewhere in their rectangles each
/// edge function is not below its bound, and 1/z not surely less than what all rays have found. A
/// maximum over a rectangle is a sum as of a ray at its corner with three roundings more, of values
/// up to 32 times the coefficients; frame.rounding is 1.8 times what rays need, so it covers these.
uint met_groups(Setup s, bool on_grid) {
    vec3 reach = s.c + s.bound;
    float q_reach = s.q.z + s.q_error;
    uint groups = 0u;
    if (on_grid) {
        // 8x4 pixels, of which the outermost middles are 3.5 and 1.5 from the group's.
        reach += 3.5f * abs(s.a) + 1.5f * abs(s.b);
        q_reach += 3.5f * abs(s.q.x) + 1.5f * abs(s.q.y);
    }
    [[unroll]] for (uint g = 0u; g < kGroups; ++g) {
        vec3 e;
        float q;
        if (on_grid) {
            float x = (g & 1u) == 0u ? -4.0f : 4.0f;
            float y = 4.0f * float(g >> 1u) + 2.0f - float(kGroups);
            e = reach + x * s.a + y * s.b;
            q = q_reach + x * s.q.x + y * s.q.y;
        } else {
            vec2 l = group_lower[g];
            vec2 u = group_upper[g];
            e = reach + greater(s.a * l.x, s.a * u.x) + greater(s.b * l.y, s.b * u.y);
            q = q_reach + greater(s.q.x * l.x, s.q.x * u.x) + greater(s.q.y * l.y, s.q.y * u.y);
        }
        groups |= least(e) >= 0.0f && q >= group_q[g] ? 1u << g : 0u;
    }
    return groups;
}

/// A triangle by its leaf and its slot there, as packets keep it.
uint triangle_name(uint leaf, uint i) { return leaf * 16u + i; }
const uint kNoTriangle = 0xFFFFFFFFu;

/// Triangles that wait to be traced, one on each of the first lanes: its name, the groups that it
/// may concern (none: it was traced), its corners and their error.
uint pending_count;
uint pending_names;
uint pending_groups;
Corners pending_corners;
float pending_error;
/// How many are worth tracing while there are more leaves.
const uint kEnough = kLanes - kLanes / 4u;

/// Adds as many of the leaf's triangles, given as bits, as there are lanes for. Returns the rest.
uint append_triangles(uint leaf, uint alive) {
    uint rest = alive;
    [[unroll]] for (uint k = 0u; k < kLanes - 1u; ++k) {
        rest = lane > k + pending_count ? rest & (rest - 1u) : rest;
    }
    bool is_new = lane >= pending_count && rest != 0u;
    uint triangle = uint(findLSB(rest)) & 15u;
    uint from = triangle & (kLanes - 1u);
    uint words = read_lane(corner_words[0], from);
    uint groups = read_lane(triangle_groups[0], from);
    [[unroll]] for (uint h = 1u; h < kSlots; ++h) {
        uint other = read_lane(corner_words[h], from);
        uint other_groups = read_lane(triangle_groups[h], from);
        words = triangle / kLanes == h ? other : words;
        groups = triangle / kLanes == h ? other_groups : groups;
    }
    Corners t = projected_triangle(words);
    pending_corners.x = is_new ? t.x : pending_corners.x;
    pending_corners.y = is_new ? t.y : pending_corners.y;
    pending_corners.z = is_new ? t.z : pending_corners.z;
    pending_error = is_new ? leaf_error : pending_error;
    pending_groups = is_new ? groups : pending_groups;
    pending_names = is_new ? triangle_name(leaf, triangle) : pending_names;
    pending_count = cluster_max(is_new ? lane + 1u : pending_count);
    return alive & ~cluster_or(is_new ? 1u << triangle : 0u);
}

/// The set-up of lane `from`, on all lanes.
Setup read_setup(Setup own, uint from) {
    return Setup(read_lane(own.a, from), read_lane(own.b, from), read_lane(own.c, from),
                 read_lane(own.q, from), read_lane(own.bound, from), read_lane(own.q_error, from),
                 read_lane(own.win_error, from));
}

vec3 leaf_vertex(uint leaf_at, uint slot) {
    return uintBitsToFloat(imageLoad(leaves, int(leaf_at + slot)).xyz);
}

uint named_triangle(uint name, out vec3 a, out vec3 b, out vec3 c) {
    uint i = name & 15u;
    uint at = (name >> 4u) * kLeafVec4s;
    uint corners = imageLoad(leaves, int(at + i)).w;
    a = leaf_vertex(at, corner(corners, 0u));
    b = leaf_vertex(at, corner(corners, 1u));
    c = leaf_vertex(at, corner(corners, 2u));
    return imageLoad(leaves, int(at + kLeafPrimIds + i / 4u))[i % 4u];
}

#endif  // SHADERS_PACKET_LEAF_GLSL
