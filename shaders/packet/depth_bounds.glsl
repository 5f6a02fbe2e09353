// Bound of the distance from a triangle's plane at which the rule may place a hit, for a packet.
#ifndef SHADERS_PACKET_DEPTH_BOUNDS_GLSL
#define SHADERS_PACKET_DEPTH_BOUNDS_GLSL

#include "common/interop/packet_bounds.h"
#include "shaders/packet/packet.glsl"

/// The rays of a packet have the directions D = middle + x step_x + y step_y at z = 1, in scene
/// space.
struct Directions {
    /// The largest component of any D.
    float depth;
    /// The largest component of a step in x and y: on any axis, and on that of the largest
    /// component of D, the rule's z.
    float step;
    float axis_step;
    /// The largest sum of a step's components, that on the rule's z counted twice.
    float lateral;
    /// 1 / |det(step_x, step_y, D)|, or kDone if this determinant is at most kLeastVolume.
    float volume;
    /// The part of z in the errors of projected vertices.
    float depth_share;
};

Directions directions;

/// Sets the directions for |x|, |y| <= reach. The rows of the frame must be set.
void set_directions(vec3 middle, vec3 step_x, vec3 step_y, vec2 reach) {
    vec3 size_x = abs(step_x);
    vec3 size_y = abs(step_y);
    // 2^-20, for the rounding of directions.
    vec3 spread = reach.x * size_x + reach.y * size_y + 9.5367431640625e-07f * abs(middle);
    vec3 lower = abs(middle) - spread;
    vec3 upper = abs(middle) + spread;
    bool is_x = lower.x > greater(upper.y, upper.z);
    bool is_y = lower.y > greater(upper.z, upper.x);
    bool is_z = lower.z > greater(upper.x, upper.y);
    vec3 steps = size_x + size_y;
    directions.depth = largest_component(upper);
    directions.step = largest_component(steps);
    directions.axis_step = is_x ? steps.x : is_y ? steps.y : is_z ? steps.z : directions.step;
    vec3 weights =
        vec3(is_y || is_z ? 1.0f : 2.0f, is_z || is_x ? 1.0f : 2.0f, is_x || is_y ? 1.0f : 2.0f);
    directions.lateral = greater(dot(weights, size_x), dot(weights, size_y));
    float volume = abs(dot(middle, cross(step_x, step_y)));
    directions.volume = volume > kLeastVolume ? 1.0f / volume : kDone;
    directions.depth_share =
        frame.row_size.z / (frame.row_size.x + frame.row_size.y + 34.0f * frame.row_size.z);
}

/// Sizes of a triangle's vertices relative to a ray of the packet.
struct Extents {
    /// The largest |x| + |y|, and the largest range of x or y.
    float size;
    float edge;
    /// Bound of |x| + |y| of an edge relative to any ray of the packet.
    float longest;
    float z_range;
    float z_size;
    /// Bound of the errors of x and y.
    float error;
    /// 1 / (n.p), n the cross product of two edges and p a vertex.
    float scale;
};

/// The bound by_q * q + by_q2 * q^2, in q = 1/z.
struct RuleDepth {
    float by_q;
    float by_q2;
};

/// Bound of the error of the rule's z.
///
/// 1. On the rule's own axis it is at most (2 B / S + kWeightRounding) R + kMeanRounding Z
///    (docs/design/arithmetic.md, "Depth"). R and Z are the range and the largest size of the
///    vertices' z, B = r (m + 2 r) is the bound of fast_edges, S = |dir.z dir.N| the sum of the
///    edge functions, N the cross product of two edges.
/// 2. At the plane z dir.N = dir.z a.N, and a.N is the packet's n.p / volume. So with m = |dir.z|
///    m' the error relative to z is at most
///        2 r (m' + 2 r) R volume scale + (kWeightRounding R + kMeanRounding Z) / z,
///        r = kFastProjectionError (4 m' + Z) + floor.
/// 3. A vertex is D z + x step_x + y step_y relative to a ray D, which bounds R and Z. The rule's
///    |x| + |y| is |dir.z| times that of x step_x + y step_y, with z counted at most twice, since
///    |D.x| + |D.y| <= 2 |D.z|.
/// 4. A ray through the triangle is the mean of its vertices under weights w. So each vertex is
///    within 1 - w of the longest edge from it, and all three together within 2 of it: 2 longest
///    lateral is a bound of m'.
/// 5. The errors of these steps are less than half of the bound, if the vertices are apart
///    (is_apart: edges an eighth, n.p a tenth) and B <= S / 64 (S of exact and of fast functions
///    a twentieth).
/// 6. Otherwise, and if the bound were a quarter of z, the bound is that of boxes: the rule takes
///    these functions only if the part of B is less than the depth margin.
RuleDepth rule_depth(Extents t, float q_most, float z_error) {
    float depth = directions.depth * t.z_size + directions.step * t.size;
    // 2^-20.
    float range =
        directions.depth * t.z_range + directions.axis_step * t.edge + 9.5367431640625e-07f * depth;
    float m = 2.0f * directions.lateral * t.longest;
    float r = kFastProjectionError * (4.0f * m + depth) + kFastProjectionFloor;
    float weights = 2.0f * r * (m + 2.0f * r) * directions.volume * t.scale;
    RuleDepth d;
    d.by_q = kNarrowWeights * weights * range;
    // row_size.z is at least the packet's z by the rule's.
    d.by_q2 = frame.row_size.z * (kWeightRounding * range + kRuleDepthError * depth) + z_error;
    bool is_apart = 128.0f * t.error * t.size * t.z_size * t.scale < 1.0f;
    float relative = d.by_q + d.by_q2 * q_most;
    bool is_narrow = is_apart && directions.volume < kDone && weights * depth <= 0.03125f &&
                     relative <= lesser(kNarrowDepth, frame.depth_error * q_most);
    d.by_q = is_narrow ? d.by_q : 0.0f;
    d.by_q2 = is_narrow ? d.by_q2 : kRuleDepthFactor * frame.depth_error;
    return d;
}

#endif  // SHADERS_PACKET_DEPTH_BOUNDS_GLSL
