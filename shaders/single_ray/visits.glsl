// Rays in the traversal, one a lane. The answer: the bits of t, u and v of the closest hit, and the
// triangle, by the hit rule (common/interop/hit_rule.h) in any order of visits. Keys are the bits of the
// least depth of hits in a box.
#include "common/interop/slab.h"
#include "common/interop/hit_rule.h"

layout(constant_id = kConstantStepBudget) const uint kSteps = kStepBudget;

READ4_IN_PLACE(Quarters, quarters, kBindQuarters);
READ4_IN_PLACE(Groups, groups, kBindGroups);
layout(std430, binding = kBindWork) buffer Work {
    WorkHeader header;
    Suspended suspended[];
} work;

#include "shaders/traversal.glsl"

/// The planes that the ray meets first and last on each axis: how far they are from quarter_at(),
/// and the ray's origin for each of them, as in hits_box. Axes are rotated so that z is the main one.
struct NodeRay {
    uvec3 near_planes;
    uvec3 far_planes;
    vec3 near_org;
    vec3 far_org;
    vec3 rdir;
    float depth_margin;
};

uvec3 rotate_offsets(uvec3 v, uint axis) { return axis == 0u ? v.yzx : axis == 1u ? v.zxy : v; }

NodeRay node_ray(SlabRay s) {
    vec3 rdir = rotate_axes(s.rdir, s.axis);
    vec3 org_lower = rotate_axes(s.org_lower, s.axis);
    vec3 org_upper = rotate_axes(s.org_upper, s.axis);
    bvec3 negative = lessThan(rdir, vec3(0.0f));
    uvec3 lower = rotate_offsets(uvec3(0u, 2u, 4u) * kPlaneVec4s, s.axis);
    uvec3 upper = lower + kPlaneVec4s;
    NodeRay n;
    n.near_planes = mix(lower, upper, negative);
    n.far_planes = mix(upper, lower, negative);
    n.near_org = mix(org_lower, org_upper, negative);
    n.far_org = mix(org_upper, org_lower, negative);
    n.rdir = rdir;
    n.depth_margin = s.depth_margin;
    return n;
}

/// The distances at which the ray meets four planes.
vec4 distances(uvec4 planes, float org, float rdir) {
    precise vec4 relative = uintBitsToFloat(planes) - vec4(org);
    precise vec4 t = relative * vec4(rdir);
    return t;
}

struct FourBoxes {
    bvec4 is_hit;
    vec4 least;
};

/// Applies hits_box to four boxes, whose planes are given as the ray meets them. (max and min get no
/// NaN, and the sign of a zero does not change a comparison.)
FourBoxes meet(NodeRay ray, float last, uvec4 near_x, uvec4 near_y, uvec4 near_z, uvec4 far_x,
               uvec4 far_y, uvec4 far_z) {
    vec4 enter_z = distances(near_z, ray.near_org.z, ray.rdir.z);
    vec4 enter = max(max(distances(near_x, ray.near_org.x, ray.rdir.x),
                         distances(near_y, ray.near_org.y, ray.rdir.y)),
                     max(enter_z, vec4(0.0f)));
    precise vec4 leave = min(min(distances(far_x, ray.far_org.x, ray.rdir.x),
                                 distances(far_y, ray.far_org.y, ray.rdir.y)),
                             distances(far_z, ray.far_org.z, ray.rdir.z)) *
                         vec4(kSlabRounding);
    precise vec4 early = enter - vec4(ray.depth_margin);
    FourBoxes boxes;
    // The bits of these are keys, so no zero is negative.
    boxes.least = abs(max(max(enter_z, early), vec4(0.0f)));
    bvec4 is_near = lessThanEqual(boxes.least, vec4(last));
    bvec4 is_met = lessThanEqual(enter, leave);
    boxes.is_hit = bvec4(uvec4(is_near) & uvec4(is_met));
    return boxes;
}

uint bits_of(bvec4 b) {
    return uint(b.x) | uint(b.y) << 1u | uint(b.z) << 2u | uint(b.w) << 3u;
}

/// Meets the four boxes at a place of a buffer. `stride` follows the offsets of planes of a node.
#define MEET_FOUR(buffer, ray, last, at, stride)                       \
    meet(ray, last, AT4_IN_PLACE(buffer, at + ray.near_planes.x stride), \
         AT4_IN_PLACE(buffer, at + ray.near_planes.y stride),           \
         AT4_IN_PLACE(buffer, at + ray.near_planes.z stride),           \
         AT4_IN_PLACE(buffer, at + ray.far_planes.x stride),            \
         AT4_IN_PLACE(buffer, at + ray.far_planes.y stride),            \
         AT4_IN_PLACE(buffer, at + ray.far_planes.z stride))

Ray ray;
NodeRay boxes;
ShearedRay sheared;
/// Whether the first hit ends the traversal.
bool any_hit;

void begin_ray(Ray traced, bool is_any_hit) {
    ray = traced;
    boxes = node_ray(slab_ray(ray.org, ray.dir));
    sheared = shear_ray(ray.org, ray.dir);
    any_hit = is_any_hit;
    answer = uvec4(floatBitsToUint(ray.tfar), 0u, 0u, kNoPrim);
    begin_traversal();
}

bool has_hit() { return answer.w != kNoPrim; }

Hit closest_hit() {
    if (!has_hit()) return no_hit();
    return hit_from(answer);
}

/// Before the first hit the ray's tfar.
float closest_t() { return uintBitsToFloat(answer.x); }

uint last_key() { return floatBitsToUint(last_depth(closest_t())); }

void meet_quarter(uint node, uint quarter, float last) {
    FourBoxes four = MEET_FOUR(nodes, boxes, last, quarter_at(node, quarter), );
    if (bits_of(four.is_hit) == 0u) return;
    uvec4 child = four_children(node, quarter);
    if (four.is_hit.x) consider(child.x, floatBitsToUint(four.least.x));
    if (four.is_hit.y) consider(child.y, floatBitsToUint(four.least.y));
    if (four.is_hit.z) consider(child.z, floatBitsToUint(four.least.z));
    if (four.is_hit.w) consider(child.w, floatBitsToUint(four.least.w));
}

uint meet_children(uint node) {
    float last = last_depth(closest_t());
    uint met = bits_of(MEET_FOUR(quarters, boxes, last, node * kQuarterVec4s, / kPlaneVec4s).is_hit);
    while (met != 0u) {
        uint quarter = uint(findLSB(met));
        met &= met - 1u;
        meet_quarter(node, quarter, last);
    }
    return 6u;
}

/// The rule's fast path, for a triangle that is surely_inside and whose z have one sign.
bool fast_hit(vec3 a, vec3 b, vec3 c, out TriangleHit hit) {
    vec3 pa = project_fast(sheared, a);
    vec3 pb = project_fast(sheared, b);
    vec3 pc = project_fast(sheared, c);
    weighted_hit(sheared, fast_edges(pa, pb, pc), pa.z, pb.z, pc.z, hit);
    return is_in_range(hit.t, ray.tnear, ray.tfar) && finite_vertices(a, b, c);
}

void test_triangle(uint leaf, uint i) {
    vec3 a, b, c;
    leaf_triangle(leaf, i, a, b, c);
    Edges e = fast_edges(project_fast(sheared, a), project_fast(sheared, b),
                         project_fast(sheared, c));
    if (!may_be_inside(e)) return;
    // Triangles that reach behind the origin are not sure: there the fast path may not hold.
    bool is_sure = surely_inside(sheared, e) && e.depth_range < e.depth_size;
    TriangleHit hit;
    bool is_hit = is_sure && fast_hit(a, b, c, hit);
    if (!is_sure || is_rough(hit))
        is_hit = intersect_triangle(sheared, ray.tnear, closest_t(), a, b, c, hit);
    if (!is_hit) return;
    uint prim_id = leaf_prim(leaf, i);
    if (is_closer(hit.t, prim_id, closest_t(), answer.w)) {
        answer = uvec4(floatBitsToUint(hit.t), floatBitsToUint(hit.u), floatBitsToUint(hit.v),
                       prim_id);
    }
}

uint test_triangles(uint leaf, uint count) {
    // A single group has the box by which the leaf was found.
    uint met = (1u << (count + 3u) / 4u) - 1u;
    if (count > 4u) {
        float last = last_depth(closest_t());
        met = bits_of(MEET_FOUR(groups, boxes, last, leaf * kQuarterVec4s, / kPlaneVec4s).is_hit);
    }
    while (met != 0u) {
        uint first = 4u * uint(findLSB(met));
        met &= met - 1u;
        for (uint i = first; i < min(first + 4u, count); ++i) test_triangle(leaf, i);
    }
    if (any_hit && has_hit()) stack_size = 0u;
    triangle = count;
    return 6u + count;
}

/// Reports, and leaves a ray that is not finished to `resume`. The order of the list depends on the
/// schedule; the answers do not.
void end_ray(uint answer_index) {
    report();
    if (finished()) return;
    uint i = atomicAdd(work.header.suspended_count, 1u);
    work.suspended[i].ray = ray;
    work.suspended[i].answer_index = answer_index;
}
