// The traversal of one ray a lane over the shared layout, depth first, nearest child next. The answer
// follows the hit rule (common/interop/hit_rule.h) in any order of visits.
#include "common/interop/slab.h"
#include "common/interop/hit_rule.h"
#include "shaders/tree.glsl"

layout(constant_id = kConstantStepBudget) const uint kSteps = kStepBudget;

READ4_IN_PLACE(Quarters, quarters, kBindQuarters);
READ4_IN_PLACE(Groups, groups, kBindGroups);
layout(std430, binding = kBindWork) buffer Work {
    WorkHeader header;
    Suspended suspended[];
} work;

/// Entries (child, bits of the least depth of hits in it).
uvec2 stack[kMaxStack];

struct Traversal {
    /// The next node or leaf to visit; kEmptyChild when the traversal is finished.
    uint current;
    uint stack_size;
    uint best_prim;
    /// Before the first hit best.t is the ray's tfar.
    TriangleHit best;
    uint status;
};

Traversal begin_traversal(Ray ray) {
    return Traversal(0u, 0u, kNoPrim, TriangleHit(ray.tfar, 0.0f, 0.0f, 0.0f, 0.0f), 0u);
}

bool finished(Traversal t) { return t.current == kEmptyChild; }

Hit closest_hit(Traversal t) {
    return t.best_prim == kNoPrim ? no_hit() : make_hit(t.best, t.best_prim);
}

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
    boxes.least = max(max(enter_z, early), vec4(0.0f));
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

/// Makes a child the next to visit if it is the nearest so far, and pushes the other one.
void consider(inout Traversal t, inout float nearest, uint child, float least) {
    bool is_nearer = least < nearest;
    if (t.current != kEmptyChild) {
        stack[t.stack_size] = is_nearer ? uvec2(t.current, floatBitsToUint(nearest))
                                        : uvec2(child, floatBitsToUint(least));
        t.stack_size += 1u;
    }
    if (!is_nearer) return;
    t.current = child;
    nearest = least;
}

/// Tests slots 4 * quarter to 4 * quarter + 3 of a node.
void visit_quarter(inout Traversal t, inout float nearest, NodeRay ray, float last, uint node,
                   uint quarter) {
    FourBoxes boxes = MEET_FOUR(nodes, ray, last, quarter_at(node, quarter), );
    if (bits_of(boxes.is_hit) == 0u) return;
    uvec4 child = four_children(node, quarter);
    if (boxes.is_hit.x) consider(t, nearest, child.x, boxes.least.x);
    if (boxes.is_hit.y) consider(t, nearest, child.y, boxes.least.y);
    if (boxes.is_hit.z) consider(t, nearest, child.z, boxes.least.z);
    if (boxes.is_hit.w) consider(t, nearest, child.w, boxes.least.w);
}

/// Pops entries up to one that may hold a closer hit. Returns the number of iterations.
uint pop(inout Traversal t) {
    uint steps = 0u;
    float last = last_depth(t.best.t);
    t.current = kEmptyChild;
    do {
        bool is_any = t.stack_size > 0u;
        t.stack_size -= is_any ? 1u : 0u;
        uvec2 entry = stack[t.stack_size];
        bool is_near = is_any && uintBitsToFloat(entry.y) <= last;
        t.current = is_near ? entry.x : kEmptyChild;
        ++steps;
    } while (t.current == kEmptyChild && t.stack_size > 0u);
    return steps;
}

uint visit_node(inout Traversal t, NodeRay ray) {
    if (t.stack_size + kWidth - 1u > kMaxStack) {
        t.status |= kStatusStackOverflow;
        t.current = kEmptyChild;
        t.stack_size = 0u;
        return 1u;
    }
    uint node = t.current;
    float nearest = 3.0e38f;
    float last = last_depth(t.best.t);
    t.current = kEmptyChild;
    uint met = bits_of(MEET_FOUR(quarters, ray, last, node * kQuarterVec4s, / kPlaneVec4s).is_hit);
    while (met != 0u) {
        uint quarter = uint(findLSB(met));
        met &= met - 1u;
        visit_quarter(t, nearest, ray, last, node, quarter);
    }
    return t.current == kEmptyChild ? 6u + pop(t) : 6u;
}

void take_hit(inout Traversal t, TriangleHit hit, uint prim_id) {
    if (!is_closer(hit.t, prim_id, t.best.t, t.best_prim)) return;
    t.best = hit;
    t.best_prim = prim_id;
}

/// The rule's fast path, for a triangle that is surely_inside and whose z have one sign.
bool fast_hit(Ray ray, ShearedRay sheared, vec3 a, vec3 b, vec3 c, out TriangleHit hit) {
    vec3 pa = project_fast(sheared, a);
    vec3 pb = project_fast(sheared, b);
    vec3 pc = project_fast(sheared, c);
    weighted_hit(sheared, fast_edges(pa, pb, pc), pa.z, pb.z, pc.z, hit);
    return is_in_range(hit.t, ray.tnear, ray.tfar) && finite_vertices(a, b, c);
}

uint visit_leaf(inout Traversal t, Ray ray, NodeRay boxes, ShearedRay sheared, bool any_hit) {
    uint leaf = leaf_of(t.current);
    uint count = leaf_triangle_count(leaf);
    // A single group has the box by which the leaf was found.
    uint met = (1u << (count + 3u) / 4u) - 1u;
    if (count > 4u) {
        float last = last_depth(t.best.t);
        met = bits_of(MEET_FOUR(groups, boxes, last, leaf * kQuarterVec4s, / kPlaneVec4s).is_hit);
    }
    while (met != 0u) {
        uint first = 4u * uint(findLSB(met));
        met &= met - 1u;
        for (uint i = first; i < min(first + 4u, count); ++i) {
            vec3 a, b, c;
            leaf_triangle(leaf, i, a, b, c);
            Edges e = fast_edges(project_fast(sheared, a), project_fast(sheared, b),
                                 project_fast(sheared, c));
            if (!may_be_inside(e)) continue;
            // Triangles that reach behind the origin are not sure: there the fast path may not hold.
            bool is_sure = surely_inside(sheared, e) && e.depth_range < e.depth_size;
            TriangleHit hit;
            bool is_hit = is_sure && fast_hit(ray, sheared, a, b, c, hit);
            if (!is_sure || is_rough(hit))
                is_hit = intersect_triangle(sheared, ray.tnear, t.best.t, a, b, c, hit);
            if (is_hit) take_hit(t, hit, leaf_prim(leaf, i));
        }
    }
    if (any_hit && t.best_prim != kNoPrim) t.stack_size = 0u;
    return 6u + count + pop(t);
}

/// Continues until finished() or the steps are used up. With `any_hit` the first hit ends it.
void traverse(inout Traversal t, Ray ray, bool any_hit) {
    NodeRay boxes = node_ray(slab_ray(ray.org, ray.dir));
    ShearedRay sheared = shear_ray(ray.org, ray.dir);
    uint steps = 0u;
    do {
        while (!is_leaf(t.current) && steps < kSteps) steps += visit_node(t, boxes);
        if (is_leaf(t.current) && t.current != kEmptyChild)
            steps += visit_leaf(t, ray, boxes, sheared, any_hit);
    } while (t.current != kEmptyChild && steps < kSteps);
}

/// Leaves the ray to `resume`. The order of the list depends on the schedule; the answers do not.
void suspend(Ray ray, uint answer_index) {
    uint i = atomicAdd(work.header.suspended_count, 1u);
    work.suspended[i].ray = ray;
    work.suspended[i].answer_index = answer_index;
}

void report(uint status_bits) {
    if (status_bits != 0u) atomicOr(work.header.status, status_bits);
}
