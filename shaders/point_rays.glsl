// Rays from one point on a cluster of lanes, and the nodes that they meet. A node is fetched once for
// all rays that got there; lanes are its children, relative to the point and dilated as in
// slab_ray, and rays come in turn.
#ifndef SHADERS_POINT_RAYS_GLSL
#define SHADERS_POINT_RAYS_GLSL

#extension GL_EXT_control_flow_attributes : require

#include "common/interop/slab.h"
#include "shaders/cluster.glsl"

layout(binding = kBindNodes) uniform usamplerBuffer nodes;

/// The rays of the pixel: lane l has those of numbers l, l + kLanes, ...
vec3 org;
vec3 dirs[kSlots];
vec3 rdirs[kSlots];
float tfars[kSlots];
/// Rays that have not been found to be occluded, as bits.
uint alive;

vec3 read_ray(vec3 values[kSlots], uint ray) {
    vec3 v = read_lane(values[0], ray & (kLanes - 1u));
    [[unroll]] for (uint k = 1u; k < kSlots; ++k) {
        vec3 other = read_lane(values[k], ray & (kLanes - 1u));
        v = ray / kLanes == k ? other : v;
    }
    return v;
}

float read_ray(float values[kSlots], uint ray) {
    float v = read_lane(values[0], ray & (kLanes - 1u));
    [[unroll]] for (uint k = 1u; k < kSlots; ++k) {
        float other = read_lane(values[k], ray & (kLanes - 1u));
        v = ray / kLanes == k ? other : v;
    }
    return v;
}

/// The node that was visited last, and for each child of this lane the rays that meet it and have
/// not been there; and the same of the nodes above it.
uint node;
uint children[kSlots];
uint waiting[kSlots];
const uint kMaskWords = (kSlots + 1u) / 2u;
uint level;
uint level_nodes[kMaxDepth + 1u];
uint level_masks[kMaskWords * (kMaxDepth + 1u)];

/// Which of the four boxes of a quarter of a node is this lane's k-th.
uint own_of_four(uint k) { return kLanes == 4u ? k : (lane >> 2u) * kSlots + k; }

void fetch_children() {
    uvec4 child = texelFetch(nodes, int(node * kNodeVec4s + kNodeChild + (lane & 3u)));
    [[unroll]] for (uint k = 0u; k < kSlots; ++k) {
        uint own = own_of_four(k);
        children[k] = own < 2u ? (own == 0u ? child.x : child.y) : (own == 2u ? child.z : child.w);
    }
}

void push_level() {
    uint any = 0u;
    level_nodes[level] = node;
    [[unroll]] for (uint w = 0u; w < kMaskWords; ++w) {
        uint upper = kSlots > 1u ? waiting[min(2u * w + 1u, kSlots - 1u)] : 0u;
        uint words = waiting[2u * w] | upper << 16u;
        level_masks[level * kMaskWords + w] = words;
        any |= words;
    }
    level += cluster_or(any) != 0u ? 1u : 0u;
}

void pop_level() {
    --level;
    node = level_nodes[level];
    [[unroll]] for (uint w = 0u; w < kMaskWords; ++w) {
        uint words = level_masks[level * kMaskWords + w];
        waiting[2u * w] = words & 0xFFFFu;
        if (kSlots > 1u) waiting[min(2u * w + 1u, kSlots - 1u)] = words >> 16u;
    }
    fetch_children();
}

/// What to visit next, a node or leaf or kEmptyChild, and which rays go there.
uint current;
uint current_rays;

/// A child that the last of the rays meets, so that one ray after the other comes to its end.
void take_child(inout uint steps) {
    current = kEmptyChild;
    bool more = true;
    do {
        uint best = 0u;
        [[unroll]] for (uint k = 0u; k < kSlots; ++k) {
            waiting[k] &= alive;
            uint key = waiting[k] << 8u | k << 4u | lane;
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

/// Of one axis, the planes of this lane's boxes relative to the point, dilated as in slab_ray.
void fetch_planes(uint offset, float org_lower, float org_upper, out float lower[kSlots],
                  out float upper[kSlots]) {
    uint at = node * kNodeVec4s + offset + (lane & 3u);
    if (kLanes == 8u) {
        // One half fetches the lower planes, the other the upper ones, and they swap two each.
        bool is_upper = lane >= 4u;
        precise vec4 v = uintBitsToFloat(texelFetch(nodes, int(is_upper ? at + 4u : at))) -
                         vec4(is_upper ? org_upper : org_lower);
        vec2 other = subgroupShuffleXor(is_upper ? v.xy : v.zw, 4u);
        lower[0] = is_upper ? other.x : v.x;
        lower[kSlots - 1u] = is_upper ? other.y : v.y;
        upper[0] = is_upper ? v.z : other.x;
        upper[kSlots - 1u] = is_upper ? v.w : other.y;
        return;
    }
    precise vec4 l = uintBitsToFloat(texelFetch(nodes, int(at))) - vec4(org_lower);
    precise vec4 u = uintBitsToFloat(texelFetch(nodes, int(at + 4u))) - vec4(org_upper);
    [[unroll]] for (uint k = 0u; k < kSlots; ++k) {
        lower[k] = own_plane(l, k);
        upper[k] = own_plane(u, k);
    }
}

void visit_node(inout uint steps) {
    push_level();
    node = current;
    fetch_children();
    float d = box_dilation(org);
    precise vec3 org_lower = org + vec3(d);
    precise vec3 org_upper = org - vec3(d);
    float lower_x[kSlots], upper_x[kSlots];
    float lower_y[kSlots], upper_y[kSlots];
    float lower_z[kSlots], upper_z[kSlots];
    fetch_planes(kNodeLowerX, org_lower.x, org_upper.x, lower_x, upper_x);
    fetch_planes(kNodeLowerY, org_lower.y, org_upper.y, lower_y, upper_y);
    fetch_planes(kNodeLowerZ, org_lower.z, org_upper.z, lower_z, upper_z);
    uint met[kSlots];
    [[unroll]] for (uint k = 0u; k < kSlots; ++k) met[k] = 0u;
    uint left = current_rays;
    do {
        uint r = uint(findLSB(left)) & 15u;
        vec3 rdir = read_ray(rdirs, r);
        float tfar = read_ray(tfars, r);
        [[unroll]] for (uint k = 0u; k < kSlots; ++k) {
            precise float lx = lower_x[k] * rdir.x;
            precise float ux = upper_x[k] * rdir.x;
            precise float ly = lower_y[k] * rdir.y;
            precise float uy = upper_y[k] * rdir.y;
            precise float lz = lower_z[k] * rdir.z;
            precise float uz = upper_z[k] * rdir.z;
            // The nearer plane is that of the lesser distance, boxes that are empty aside.
            float enter = greater(greater(lesser(lx, ux), lesser(ly, uy)),
                                  greater(lesser(lz, uz), 0.0f));
            float leave = lesser(lesser(greater(lx, ux), greater(ly, uy)),
                                 lesser(greater(lz, uz), tfar));
            met[k] |= enter <= leave ? 1u << r : 0u;
        }
        left &= left - 1u;
        ++steps;
    } while (left != 0u);
    [[unroll]] for (uint k = 0u; k < kSlots; ++k) {
        waiting[k] = children[k] == kEmptyChild ? 0u : met[k];
    }
}

#endif  // SHADERS_POINT_RAYS_GLSL
