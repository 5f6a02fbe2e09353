// Rays in the traversal, one a lane. The answer: the bits of t, u and v of the closest hit, and the
// triangle, by the hit rule (common/interop/hit_rule.h) in any order of visits. Keys are the bits of the
// least depth of hits in a box.
layout(constant_id = kConstantStepBudget) const uint kSteps = kStepBudget;
#ifdef RESUMES
const uint kStackRoom = kMaxStack;
const uint kStackSize = kStackRoom;
#else
const uint kStackRoom = kShortStack;
// Open triangles lie behind the stack: a compiler would keep an array of their own in registers.
const uint kStackSize = kStackRoom + kMostOpen;
#endif

layout(std430, binding = kBindWork) buffer Work {
    WorkHeader header;
    Suspended suspended[];
} work;
READ4_IN_PLACE(Quarters, quarters, kBindQuarters);
READ4_IN_PLACE(Groups, groups, kBindGroups);

#include "common/interop/slab.h"
#include "shaders/traversal.glsl"

/// The planes that the ray meets first on each axis: how far they are from quarter_at(); and the
/// ray's origin for these and for those it meets last, as in hits_box. Axes are rotated so that z is
/// the main one.
struct NodeRay {
    /// A byte each.
    uint near_planes;
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
    uvec3 near = mix(lower, upper, negative);
    n.near_planes = near.x | near.y << 8u | near.z << 16u;
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

/// Where the ray is in four boxes on some axes.
struct FourIntervals {
    vec4 enter;
    vec4 leave;
};

FourIntervals between(NodeRay ray, uint axis, uvec4 near, uvec4 far) {
    return FourIntervals(distances(near, ray.near_org[axis], ray.rdir[axis]),
                         distances(far, ray.far_org[axis], ray.rdir[axis]));
}

/// (max and min get no NaN, and the sign of a zero does not change a comparison.)
FourIntervals both(FourIntervals a, FourIntervals b) {
    return FourIntervals(max(a.enter, b.enter), min(a.leave, b.leave));
}

/// Applies hits_box to four boxes, by their intervals on all axes and on the main one.
FourBoxes hits_boxes(NodeRay ray, float last, FourIntervals all, FourIntervals main) {
    vec4 enter = max(all.enter, vec4(0.0f));
    precise vec4 leave = all.leave * vec4(kSlabRounding);
    precise vec4 early = enter - vec4(ray.depth_margin);
    FourBoxes boxes;
    // The bits of these are keys, so no zero is negative.
    boxes.least = abs(max(max(main.enter, early), vec4(0.0f)));
    bvec4 is_near = lessThanEqual(boxes.least, vec4(last));
    bvec4 is_met = lessThanEqual(enter, leave);
    boxes.is_hit = bvec4(uvec4(is_near) & uvec4(is_met));
    return boxes;
}

uint bits_of(bvec4 b) {
    return uint(b.x) | uint(b.y) << 1u | uint(b.z) << 2u | uint(b.w) << 3u;
}

// Declares NAME(ray, last, at), which meets the four boxes at a place of a buffer, axis by axis, so that
// few planes are in registers. STRIDE follows the offsets of planes of a node.
// Near planes are even or odd numbers times kPlaneVec4s, a power of two, and far ones the others.
#define FAR_PLANE(near_plane) ((near_plane) ^ kPlaneVec4s)
#define MEET_FOUR(NAME, BUFFER, STRIDE)                                                        \
    FourIntervals NAME##_axis(NodeRay ray, uint axis, uint at) {                               \
        uint plane = bitfieldExtract(ray.near_planes, int(8u * axis), 8);                      \
        return between(ray, axis, AT4_IN_PLACE(BUFFER, at + plane STRIDE),                     \
                       AT4_IN_PLACE(BUFFER, at + FAR_PLANE(plane) STRIDE));                    \
    }                                                                                          \
    FourBoxes NAME(NodeRay ray, float last, uint at) {                                         \
        FourIntervals main = NAME##_axis(ray, 2u, at);                                         \
        FourIntervals others = both(NAME##_axis(ray, 0u, at), NAME##_axis(ray, 1u, at));       \
        return hits_boxes(ray, last, both(others, main), main);                                \
    }
MEET_FOUR(meet_slots, nodes, )
MEET_FOUR(meet_quarters, quarters, / kPlaneVec4s)
MEET_FOUR(meet_groups, groups, / kPlaneVec4s)

Ray ray;
NodeRay boxes;
ShearedRay sheared;
/// Whether the first hit ends the traversal.
bool any_hit;

// Triangles that the fast path leaves open, which `decide` decides; `resume` does it at once.
/// Their number. kMostOpen are kept; a ray with more begins again in `resume`.
uint open_count;

void begin_ray(Ray traced, bool is_any_hit) {
    ray = traced;
    boxes = node_ray(slab_ray(ray.org, ray.dir));
    sheared = shear_ray(ray.org, ray.dir);
    any_hit = is_any_hit;
    answer = uvec4(floatBitsToUint(ray.tfar), 0u, 0u, kNoPrim);
    open_count = 0u;
    begin_traversal();
}

bool has_hit() { return answer.w != kNoPrim; }

Hit closest_hit() {
    if (!has_hit()) return no_hit();
    return hit_from(answer);
}

/// No hit that counts is farther. Without an answer the ray's tfar, or where an open triangle is hit.
float closest_t() { return uintBitsToFloat(answer.x); }

int last_key() { return floatBitsToInt(last_depth(closest_t())); }

void meet_quarter(uint node, uint quarter, float last) {
    FourBoxes four = meet_slots(boxes, last, quarter_at(node, quarter));
    if (bits_of(four.is_hit) == 0u) return;
    uvec4 child = four_children(node, quarter);
    if (four.is_hit.x) consider(child.x, floatBitsToInt(four.least.x));
    if (four.is_hit.y) consider(child.y, floatBitsToInt(four.least.y));
    if (four.is_hit.z) consider(child.z, floatBitsToInt(four.least.z));
    if (four.is_hit.w) consider(child.w, floatBitsToInt(four.least.w));
}

uint meet_children(uint node) {
    float last = last_depth(closest_t());
    uint met = bits_of(meet_quarters(boxes, last, node * kQuarterVec4s).is_hit);
    while (met != 0u) {
        uint quarter = uint(findLSB(met));
        met &= met - 1u;
        meet_quarter(node, quarter, last);
    }
    return 6u;
}

/// The rule's fast path, or a triangle that stays open.
void test_triangle(uint leaf, uint i) {
    vec3 a, b, c;
    leaf_triangle(leaf, i, a, b, c);
    vec3 pa = project_fast(sheared, a);
    vec3 pb = project_fast(sheared, b);
    vec3 pc = project_fast(sheared, c);
    Edges e = fast_edges(pa, pb, pc);
    if (!may_be_inside(e) || !finite_vertices(a, b, c)) return;
    // The slack of shear_ray(), computed again so that it is in no register between.
    precise float depth_slack = 0.25f * boxes.depth_margin;
    ShearedRay with_slack = ShearedRay(sheared.org, sheared.dir, sheared.axis, depth_slack);
    // Triangles that reach behind the origin are not sure: there the fast path may not hold.
    bool is_sure = surely_inside(with_slack, e) && e.depth_range < e.depth_size;
    TriangleHit hit;
    weighted_hit(sheared, e, pa.z, pb.z, pc.z, hit);
    if (is_sure && !is_rough(hit)) {
        if (is_in_range(hit.t, ray.tnear, closest_t()))
            take_if_closer(hit, leaf_prim(leaf, i), answer);
        return;
    }
    precise float least = hit.t - hit.error;
    precise float most = hit.t + hit.error;
    if (is_sure) {
        if (!may_be_in_range(hit, ray.tnear, closest_t())) return;
        // The triangle is hit, and before the answer: any hit has been found, or a closer one.
        if (least > 0.0f && least >= ray.tnear && most < closest_t()) {
            answer = uvec4(floatBitsToUint(most), 0u, 0u, any_hit ? 0u : kNoPrim);
            if (any_hit) return;
        }
    }
    stack[kStackRoom + min(open_count, kMostOpen - 1u)].x = leaf * kLeafTriangles + i;
    open_count += 1u;
}

uint test_triangles(uint leaf, uint count) {
    // As bits, four for each group. A single group has the box by which the leaf was found.
    uint left = (1u << count) - 1u;
    if (count > 4u) {
        uint met = bits_of(meet_groups(boxes, last_depth(closest_t()), leaf * kQuarterVec4s).is_hit);
        met = (met | met << 6u) & 0x303u;
        met = (met | met << 3u) & 0x1111u;
        left &= 15u * met;
    }
    uint steps = 6u + count;
    while (left != 0u) {
        uint i = uint(findLSB(left));
        left &= left - 1u;
#ifdef RESUMES
        decide_triangle(sheared, ray.tnear, leaf, i, answer);
#else
        test_triangle(leaf, i);
#endif
    }
    if (any_hit && has_hit()) {
        stack_size = 0u;
    } else if (open_count > kMostOpen) {
        // The ray ends within the leaf, so that it does not count as finished.
        triangle = 1u;
        return kSteps;
    }
    return steps;
}

/// Leaves a ray that is not finished to `resume`, and one with open triangles to `decide`. The order
/// of the lists depends on the schedule; the answers do not.
void end_ray(uint answer_index) {
    bool is_open = finished() && open_count > 0u && !(any_hit && has_hit());
    if (finished() && !is_open) return;
    // Open rays fill the list from its end.
    uint i = is_open
                 ? uint(work.suspended.length()) - 1u - atomicAdd(work.header.open_count, 1u)
                 : atomicAdd(work.header.suspended_count, 1u);
    // From the rotated ray, which is in registers anyway.
    uint back = sheared.axis == 2u ? 2u : 1u - sheared.axis;
    work.suspended[i].ray = Ray(rotate_axes(sheared.org, back), ray.tnear,
                                rotate_axes(sheared.dir, back), ray.tfar);
    work.suspended[i].answer_index = answer_index;
    if (!is_open) return;
    for (uint k = 0u; k < kMostOpen; ++k)
        work.suspended[i].open[k] = k < open_count ? stack[kStackRoom + k].x : kNoOpen;
}
