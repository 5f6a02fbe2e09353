// One ray a lane over the shared layout, depth first, nearest child next. The answer is that of the
// hit rule (common/interop/triangle.h); the order in which boxes are visited cannot change it.
#ifndef SHADERS_TRAVERSE_GLSL
#define SHADERS_TRAVERSE_GLSL

#include "common/interop/slab.h"
#include "common/interop/triangle.h"
#include "shaders/kernel_interface.h"

layout(constant_id = kConstantStepBudget) const uint kSteps = kStepBudget;

layout(binding = kBindNodes) uniform usamplerBuffer nodes;
layout(binding = kBindLeaves) uniform usamplerBuffer leaves;

/// (child, bits of t_enter). One entry more than can be used: where nothing is to be pushed, the
/// entry above the top is overwritten all the same, which saves a branch.
uvec2 stack[kMaxStack + 1u];

/// Where a traversal stands. current is what to visit next, kEmptyChild when it is finished.
struct Traversal {
    uint current;
    uint stack_size;
    uint best_prim;
    /// Before the first hit t is the ray's tfar.
    TriangleHit best;
    uint status;
};

Traversal begin_traversal(Ray ray) {
    Traversal t;
    t.current = 0u;
    t.stack_size = 0u;
    t.best_prim = kNoPrim;
    t.best.t = ray.tfar;
    t.best.u = 0.0f;
    t.best.v = 0.0f;
    t.status = 0u;
    return t;
}

bool finished(Traversal t) { return t.current == kEmptyChild; }

Hit closest_hit(Traversal t) {
    return t.best_prim == kNoPrim ? no_hit() : make_hit(t.best, t.best_prim);
}

/// The planes that the ray meets first and last on each axis: their offsets in a node, and the
/// origins that they are taken relative to. As in hits_box.
struct NodeRay {
    uvec3 near_planes;
    uvec3 far_planes;
    vec3 near_org;
    vec3 far_org;
    vec3 rdir;
};

NodeRay node_ray(SlabRay s) {
    bvec3 negative = lessThan(s.rdir, vec3(0.0f));
    uvec3 lower = uvec3(kNodeLowerX, kNodeLowerY, kNodeLowerZ);
    uvec3 upper = uvec3(kNodeUpperX, kNodeUpperY, kNodeUpperZ);
    NodeRay n;
    n.near_planes = mix(lower, upper, negative);
    n.far_planes = mix(upper, lower, negative);
    n.near_org = mix(s.org_lower, s.org_upper, negative);
    n.far_org = mix(s.org_upper, s.org_lower, negative);
    n.rdir = s.rdir;
    return n;
}

/// Where the ray meets four planes.
vec4 distances(uint at, float org, float rdir) {
    precise vec4 relative = uintBitsToFloat(texelFetch(nodes, int(at))) - vec4(org);
    precise vec4 t = relative * vec4(rdir);
    return t;
}

/// A child that is hit becomes the next to visit if it is the nearest so far; the other is pushed.
void consider(inout Traversal t, inout float nearest, uint child, float t_enter, bool is_hit) {
    bool nearer = is_hit && t_enter < nearest;
    stack[t.stack_size] = nearer ? uvec2(t.current, floatBitsToUint(nearest))
                                 : uvec2(child, floatBitsToUint(t_enter));
    t.stack_size += is_hit && t.current != kEmptyChild ? 1u : 0u;
    t.current = nearer ? child : t.current;
    nearest = nearer ? t_enter : nearest;
}

/// Slots 4 * quarter to 4 * quarter + 3 of a node: hits_box, four boxes at a time. (max
/// and min meet no NaN, and which of two zeros they return does not matter to a comparison.)
void visit_quarter(inout Traversal t, inout float nearest, NodeRay ray, uint node, uint quarter) {
    uint at = node * kNodeVec4s + quarter;
    vec4 near_x = distances(at + ray.near_planes.x, ray.near_org.x, ray.rdir.x);
    vec4 near_y = distances(at + ray.near_planes.y, ray.near_org.y, ray.rdir.y);
    vec4 near_z = distances(at + ray.near_planes.z, ray.near_org.z, ray.rdir.z);
    vec4 far_x = distances(at + ray.far_planes.x, ray.far_org.x, ray.rdir.x);
    vec4 far_y = distances(at + ray.far_planes.y, ray.far_org.y, ray.rdir.y);
    vec4 far_z = distances(at + ray.far_planes.z, ray.far_org.z, ray.rdir.z);
    vec4 enter = max(max(near_x, near_y), max(near_z, vec4(0.0f)));
    vec4 leave = min(min(far_x, far_y), far_z);
    uvec4 child = texelFetch(nodes, int(at + kNodeChild));
    consider(t, nearest, child.x, enter.x, enter.x <= min(leave.x, t.best.t));
    consider(t, nearest, child.y, enter.y, enter.y <= min(leave.y, t.best.t));
    consider(t, nearest, child.z, enter.z, enter.z <= min(leave.z, t.best.t));
    consider(t, nearest, child.w, enter.w, enter.w <= min(leave.w, t.best.t));
}

/// Takes the topmost entry that may still hold the answer. Returns the iterations it took.
uint pop(inout Traversal t) {
    uint steps = 0u;
    t.current = kEmptyChild;
    while (t.current == kEmptyChild && t.stack_size > 0u) {
        --t.stack_size;
        uvec2 entry = stack[t.stack_size];
        t.current = uintBitsToFloat(entry.y) > t.best.t ? kEmptyChild : entry.x;
        ++steps;
    }
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
    t.current = kEmptyChild;
    visit_quarter(t, nearest, ray, node, 0u);
    visit_quarter(t, nearest, ray, node, 1u);
    visit_quarter(t, nearest, ray, node, 2u);
    visit_quarter(t, nearest, ray, node, 3u);
    return t.current == kEmptyChild ? 1u + pop(t) : 1u;
}

vec3 leaf_vertex(uint leaf_at, uint slot) {
    return uintBitsToFloat(texelFetch(leaves, int(leaf_at + slot)).xyz);
}

void leaf_triangle(uint leaf_at, uint i, out vec3 a, out vec3 b, out vec3 c) {
    uint corners = texelFetch(leaves, int(leaf_at + i)).w;
    a = leaf_vertex(leaf_at, corner(corners, 0u));
    b = leaf_vertex(leaf_at, corner(corners, 1u));
    c = leaf_vertex(leaf_at, corner(corners, 2u));
}

/// The cheap test for all triangles, then the rule for those that are left: where branches are
/// masks, the rule would otherwise cost its full price for every triangle. any_hit: a hit ends the
/// traversal.
uint visit_leaf(inout Traversal t, Ray ray, ShearedRay sheared, bool any_hit) {
    uint at = (t.current & ~kLeafBit) * kLeafVec4s;
    uint count = corner_triangle_count(texelFetch(leaves, int(at)).w);
    uint steps = 1u + count;
    uint candidates = 0u;
    vec3 a, b, c;
    for (uint i = 0u; i < count; ++i) {
        leaf_triangle(at, i, a, b, c);
        candidates |= may_hit_triangle(sheared, a, b, c) ? 1u << i : 0u;
    }
    while (candidates != 0u) {
        uint i = uint(findLSB(candidates));
        candidates &= candidates - 1u;
        ++steps;
        leaf_triangle(at, i, a, b, c);
        uint prim_id = texelFetch(leaves, int(at + kLeafPrimIds + i / 4u))[i % 4u];
        TriangleHit hit;
        if (intersect_triangle(sheared, ray.tnear, ray.tfar, a, b, c, hit) &&
            wins(hit.t, prim_id, t.best.t, t.best_prim)) {
            t.best = hit;
            t.best_prim = prim_id;
        }
    }
    if (any_hit && t.best_prim != kNoPrim) t.stack_size = 0u;
    return steps + pop(t);
}

/// Continues until the answer is known or the lane's steps are used up; see finished(). Any-hit
/// traversals end with some best_prim, not the closest.
void traverse(inout Traversal t, Ray ray, bool any_hit) {
    NodeRay boxes = node_ray(slab_ray(ray.org, ray.dir));
    ShearedRay sheared = shear_ray(ray.org, ray.dir);
    uint steps = 0u;
    while (t.current != kEmptyChild && steps < kSteps) {
        // kEmptyChild has kLeafBit set, so it ends both inner loops.
        while ((t.current & kLeafBit) == 0u && steps < kSteps) {
            steps += visit_node(t, boxes);
        }
        while ((t.current & kLeafBit) != 0u && t.current != kEmptyChild && steps < kSteps) {
            steps += visit_leaf(t, ray, sheared, any_hit);
        }
        ++steps;
    }
}

#endif  // SHADERS_TRAVERSE_GLSL
