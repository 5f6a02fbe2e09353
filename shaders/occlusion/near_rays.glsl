// Rays that start near each other, on a cluster of lanes, and the nodes that they meet. A node is
// fetched once for all rays that reach it. Lanes have its children, and rays come one after the
// other.
//
// The box test here has not the bits of the slab test, but misses no box that holds a hit:
//
// 1. A ray passes the padded box of a triangle that it hits within 2^-42 E on each axis, no later
//    than at t + M of the hit (docs/design/arithmetic.md, "Boxes", steps 1, 2 and 5), with M = 2^-13 E,
//    E = max(2^20, |org|), t <= 2 E. D = 2^-19 E here, of which roundings take 3/5 or less,
//    19.2 * 2^-24 E.
// 2. plane * r - org * r instead of (plane - org) * r, with plane +- D: 5.1 * 2^-24 E.
// 3. r is 1 / dir to 1.2 ulp, and so is the unit of t. With their product this moves planes by 11.3 *
//    2^-24 E.
// 4. D is the largest of all rays', which is at least that of the ray.
// 5. For a component 0 of the direction 2^47 stands for its reciprocal instead of 2^64. It acts
//    like a component 2^-47, which moves the ray by less than 2^-47 * 2 E.
#ifndef SHADERS_OCCLUSION_NEAR_RAYS_GLSL
#define SHADERS_OCCLUSION_NEAR_RAYS_GLSL

#extension GL_EXT_control_flow_attributes : require

#include "common/interop/slab.h"
#include "shaders/base/cluster.glsl"

layout(binding = kBindNodes, rgba32ui) uniform readonly uimageBuffer nodes;

const uint kVectors = kPacketRays / kLanes;

/// The rays: lane l has numbers l, l + kLanes, ...
vec3 orgs[kVectors];
vec3 dirs[kVectors];
float tfars[kVectors];
/// Reciprocals of the directions, in a unit of t in which 1 is the last entry into boxes; and
/// reciprocals times origins.
vec3 slopes[kVectors];
vec3 starts[kVectors];
/// The dilation of boxes for all rays.
float dilation;
/// Rays that are not known to be occluded, as bits.
uint alive;

/// The dilation for rays from org, and for those with a smaller one.
float common_dilation(vec3 org) { return kBoxDilation * extent_of_rays(org); }

void set_ray(uint k, Ray ray) {
    float last = last_entry(depth_margin(ray.org), ray.tfar);
    orgs[k] = ray.org;
    dirs[k] = ray.dir;
    tfars[k] = ray.tfar;
    // 2^-20 to 2^42. A longer unit only accepts more boxes, and no hit is farther than 2^42.
    float unit_of_t = lesser(greater(last, 9.5367431640625e-07f), 4398046511104.0f);
    // 2^47
    const float kSteepest = 140737488355328.0f;
    vec3 r = vec3(slab_reciprocal(ray.dir.x), slab_reciprocal(ray.dir.y),
                  slab_reciprocal(ray.dir.z));
    slopes[k] = min(r, vec3(kSteepest)) * rcp(unit_of_t);
    starts[k] = ray.org * slopes[k];
}

vec3 read_ray(vec3 values[kVectors], uint ray) {
    vec3 v = read_lane(values[0], ray & (kLanes - 1u));
    [[unroll]] for (uint k = 1u; k < kVectors; ++k) {
        vec3 other = read_lane(values[k], ray & (kLanes - 1u));
        v = ray / kLanes == k ? other : v;
    }
    return v;
}

float read_ray(float values[kVectors], uint ray) {
    float v = read_lane(values[0], ray & (kLanes - 1u));
    [[unroll]] for (uint k = 1u; k < kVectors; ++k) {
        float other = read_lane(values[k], ray & (kLanes - 1u));
        v = ray / kLanes == k ? other : v;
    }
    return v;
}

/// The node visited last, and for each child of this lane the rays that meet it and have not
/// visited it; the same for the nodes above it.
uint node;
uint children[kSlots];
uint waiting[kSlots];
uint level;
uint level_nodes[kMaxDepth + 1u];
uint level_masks[kSlots * (kMaxDepth + 1u)];

/// The index of this lane's k-th box among the four boxes of a quarter of a node.
uint own_of_four(uint k) { return kLanes == 4u ? k : (lane >> 2u) * kSlots + k; }

void fetch_children() {
    uvec4 child = imageLoad(nodes, int(node * kNodeVec4s + kNodeChild + (lane & 3u)));
    [[unroll]] for (uint k = 0u; k < kSlots; ++k) {
        uint own = own_of_four(k);
        children[k] = own < 2u ? (own == 0u ? child.x : child.y) : (own == 2u ? child.z : child.w);
    }
}

void push_level() {
    uint any = 0u;
    level_nodes[level] = node;
    [[unroll]] for (uint k = 0u; k < kSlots; ++k) {
        level_masks[level * kSlots + k] = waiting[k];
        any |= waiting[k];
    }
    level += cluster_or(any) != 0u ? 1u : 0u;
}

void pop_level() {
    --level;
    node = level_nodes[level];
    [[unroll]] for (uint k = 0u; k < kSlots; ++k) waiting[k] = level_masks[level * kSlots + k];
    fetch_children();
}

/// The next node or leaf to visit, or kEmptyChild, and the rays that visit it.
uint current;
uint current_rays;

/// Takes a child that the ray of the highest number meets, so that rays end one after the other.
void take_child(inout uint steps) {
    current = kEmptyChild;
    bool more = true;
    do {
        uint best = 0u;
        [[unroll]] for (uint k = 0u; k < kSlots; ++k) {
            waiting[k] &= alive;
            uint key = (waiting[k] & ~511u) | 256u | k << 4u | lane;
            best = max(best, waiting[k] != 0u ? key : 0u);
        }
        best = cluster_max(best);
        if (best != 0u) {
            uint owner = best & 15u;
            uint slot = best >> 4u & 15u;
            uint child = children[0];
            uint rays = waiting[0];
            [[unroll]] for (uint k = 1u; k < kSlots; ++k) {
                child = slot == k ? children[k] : child;
                rays = slot == k ? waiting[k] : rays;
            }
            current = read_lane(child, owner);
            current_rays = read_lane(rays, owner);
            [[unroll]] for (uint k = 0u; k < kSlots; ++k) {
                waiting[k] = slot == k && lane == owner ? 0u : waiting[k];
            }
            more = false;
        } else if (level > 0u) {
            pop_level();
        } else {
            more = false;
        }
        ++steps;
    } while (more);
}

float own_plane(vec4 v, uint k) {
    uint own = own_of_four(k);
    return own < 2u ? (own == 0u ? v.x : v.y) : (own == 2u ? v.z : v.w);
}

/// Fetches both planes of each of this lane's dilated boxes on one axis, in any order.
void fetch_planes(uint offset, out float planes[kSlots], out float others[kSlots]) {
    uint at = node * kNodeVec4s + offset + (lane & 3u);
    if (kLanes == 8u) {
        // One half of the lanes fetches lower planes, the other upper ones, and they swap two each.
        bool is_upper = lane >= 4u;
        vec4 v = uintBitsToFloat(imageLoad(nodes, int(is_upper ? at + 4u : at))) +
                 vec4(is_upper ? dilation : -dilation);
        vec2 own = is_upper ? v.zw : v.xy;
        vec2 other = subgroupShuffleXor(is_upper ? v.xy : v.zw, 4u);
        planes[0] = own.x;
        planes[kSlots - 1u] = own.y;
        others[0] = other.x;
        others[kSlots - 1u] = other.y;
        return;
    }
    vec4 l = uintBitsToFloat(imageLoad(nodes, int(at))) - vec4(dilation);
    vec4 u = uintBitsToFloat(imageLoad(nodes, int(at + 4u))) + vec4(dilation);
    [[unroll]] for (uint k = 0u; k < kSlots; ++k) {
        planes[k] = own_plane(l, k);
        others[k] = own_plane(u, k);
    }
}

void visit_node(inout uint steps) {
    push_level();
    node = current;
    fetch_children();
    float ax[kSlots], bx[kSlots], ay[kSlots], by[kSlots], az[kSlots], bz[kSlots];
    fetch_planes(kNodeLowerX, ax, bx);
    fetch_planes(kNodeLowerY, ay, by);
    fetch_planes(kNodeLowerZ, az, bz);
    [[unroll]] for (uint k = 0u; k < kSlots; ++k) waiting[k] = 0u;
    uint left = current_rays;
    steps += 1u + uint(bitCount(left));
    do {
        uint r = uint(findLSB(left)) & (kPacketRays - 1u);
        vec3 slope = read_ray(slopes, r);
        vec3 start = read_ray(starts, r);
        [[unroll]] for (uint k = 0u; k < kSlots; ++k) {
            float px = ax[k] * slope.x - start.x;
            float qx = bx[k] * slope.x - start.x;
            float py = ay[k] * slope.y - start.y;
            float qy = by[k] * slope.y - start.y;
            float pz = az[k] * slope.z - start.z;
            float qz = bz[k] * slope.z - start.z;
            // The nearer plane is the one of lesser distance; empty boxes are sorted out below.
            float enter = greater(greater(lesser(px, qx), lesser(py, qy)), lesser(pz, qz));
            float leave = lesser(lesser(greater(px, qx), greater(py, qy)), greater(pz, qz));
            waiting[k] |= enter <= leave && enter <= 1.0f && leave >= 0.0f ? 1u << r : 0u;
        }
        left &= left - 1u;
    } while (left != 0u);
    [[unroll]] for (uint k = 0u; k < kSlots; ++k) {
        waiting[k] = children[k] == kEmptyChild ? 0u : waiting[k];
    }
}

#endif  // SHADERS_OCCLUSION_NEAR_RAYS_GLSL
