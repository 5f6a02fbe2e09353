// How far the rule may place a hit from the plane of its triangle, in the terms of a packet.
#ifndef SHADERS_PACKET_DEPTH_GLSL
#define SHADERS_PACKET_DEPTH_GLSL

#include "shaders/packet.glsl"

/// The rays of a packet have the directions D = middle + x step_x + y step_y at z = 1, in scene
/// space. Bounds of all D: the largest component, and the sum of the two others.
struct Directions {
    float depth;
    float aside;
    /// The largest component of a step in x and y: on any axis, and on that of the rays' largest
    /// component.
    float step;
    float axis_step;
    float lateral;
    /// 1 / |det(step_x, step_y, D)|.
    float volume;
    /// z's part of the errors of projected vertices.
    float depth_share;
};

Directions directions;

/// For |x|, |y| <= reach. After the rows are set.
void set_directions(vec3 middle, vec3 step_x, vec3 step_y, vec2 reach) {
    // 2^-20, for the rounding of directions.
    vec3 spread =
        reach.x * abs(step_x) + reach.y * abs(step_y) + 9.5367431640625e-07f * abs(middle);
    vec3 lower = abs(middle) - spread;
    vec3 upper = abs(middle) + spread;
    directions.depth = largest_component(upper);
    directions.aside = upper.x + upper.y + upper.z - greater(lower.x, greater(lower.y, lower.z));
    vec3 steps = abs(step_x) + abs(step_y);
    directions.step = largest_component(steps);
    bool is_x = lower.x > greater(upper.y, upper.z);
    bool is_y = lower.y > greater(upper.z, upper.x);
    bool is_z = lower.z > greater(upper.x, upper.y);
    vec3 weight = vec3(is_y || is_z ? 1.0f : 2.0f, is_x || is_z ? 1.0f : 2.0f, is_x || is_y ? 1.0f : 2.0f);
    directions.axis_step = is_x ? steps.x : is_y ? steps.y : is_z ? steps.z : directions.step;
    directions.lateral = greater(dot(weight, abs(step_x)), dot(weight, abs(step_y)));
    directions.volume = 1.0f / greater(abs(dot(middle, cross(step_x, step_y))), 1.0e-30f);
    directions.depth_share =
        frame.row_size.z / (frame.row_size.x + frame.row_size.y + 34.0f * frame.row_size.z);
}

/// by_q * q + by_q2 * q^2 in q = 1/z.
struct RuleDepth {
    float by_q;
    float by_q2;
};

/// A triangle in the packet: the largest |x| + |y| of its vertices and the largest range of x or y,
/// seen from a ray of the packet; of z the range and the largest size; how far x and y may be off;
/// and 1 / (n.p), n the cross product of two edges and p a vertex.
struct Extents {
    float size;
    float edge;
    float z_range;
    float z_size;
    float error;
    float scale;
};

/// The rule's z, on its own axis, is off by at most 2 B R / S + 2^-20 Z (docs/arithmetic.md,
/// "Depth"). R and Z are the range and the largest size of the vertices' z, B = |dir.z| k M (G + 4
/// M) the bound of plane_edges, with edge_planes' error k, size M and distance G aside. S = 2
/// |dir.N|, N the cross product of two edges; z dir.N = dir.z a.N where the ray meets the plane,
/// and a.N is the packet's n.p / volume. So relative to z the error is at most
///     k M (G + 4 M) R volume scale + 2^-20 Z / z.
/// A vertex is D z + x step_x + y step_y seen from a ray D, which bounds R, Z, M and G; 2^-16 Z
/// more are for what M has of Z and for rounding. The rest of that, the error of n.p (a tenth,
/// where the vertices are as far apart as is asked for here), and what S of accurate and of plain
/// functions differ by (a twentieth, where B <= S / 64) take less than the factor of 2. Elsewhere,
/// and where that were a quarter of z, what counts is that the rule takes these functions only if
/// B's part is less than the dilation of boxes.
RuleDepth rule_depth(Extents t, float q_most, float z_error) {
    float depth = directions.depth * t.z_size + directions.step * t.size;
    float moved = directions.depth * t.z_range;
    float range = moved + directions.axis_step * t.edge + 9.5367431640625e-07f * depth;
    float m = 2.0f * directions.lateral * (2.0f * t.edge + 34.0f * t.z_range);
    float r = kFastProjectionError * (4.0f * m + depth) + kFastProjectionFloor;
    float weights = 2.0f * r * (m + 2.0f * r) * directions.volume * t.scale;
    RuleDepth d;
    d.by_q = 1.5f * weights * range;
    // 1.25 * 2^-20; row_size.z is at least z / Z for a point on a ray.
    d.by_q2 = 1.1920928955078125e-06f * frame.row_size.z * depth + z_error;
    bool is_apart = 128.0f * t.error * t.size * t.z_size * t.scale < 1.0f;
    bool is_narrow = is_apart && weights * depth <= 0.03125f && d.by_q + d.by_q2 * q_most <= 0.25f;
    d.by_q = is_narrow ? d.by_q : 0.0f;
    d.by_q2 = is_narrow ? d.by_q2 : frame.depth_error;
    return d;
}

#endif  // SHADERS_PACKET_DEPTH_GLSL
