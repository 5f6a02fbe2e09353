// A cluster: lanes of a subgroup that work together. The host sets its size by the device's
// subgroups.
//
// In a subgroup with several clusters, one may leave a loop before another. Some devices then
// compute values of the loop again for the clusters that have left, from the variables that the
// loop carries, and use them after the loop (Mesa 22.3's lavapipe). So a value that depends on a
// count of the loop and is used after it is computed under a condition.
#ifndef SHADERS_BASE_CLUSTER_GLSL
#define SHADERS_BASE_CLUSTER_GLSL

#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_shuffle : require

#include "common/interop/platform.h"
#include "shaders/kernel_interface.h"

/// Lanes of a cluster: 4, 8 or 16, a part of a subgroup.
#ifdef PACKET_LANES
const uint kLanes = PACKET_LANES;
#else
layout(constant_id = kConstantPacketLanes) const uint kLanes = 8u;
#endif
/// The share of each lane in 16 children, vertices or triangles.
const uint kSlots = 16u / kLanes;

uint lane;        // index within the cluster
uint first_lane;  // index of lane 0 within the subgroup

void find_lane() {
    lane = gl_SubgroupInvocationID & (kLanes - 1u);
    first_lane = gl_SubgroupInvocationID - lane;
}

uint read_lane(uint x, uint from) { return subgroupShuffle(x, first_lane + from); }
float read_lane(float x, uint from) { return subgroupShuffle(x, first_lane + from); }
vec3 read_lane(vec3 v, uint from) {
    return vec3(read_lane(v.x, from), read_lane(v.y, from), read_lane(v.z, from));
}

vec2 lesser(vec2 a, vec2 b) { return vec2(lesser(a.x, b.x), lesser(a.y, b.y)); }
vec2 greater(vec2 a, vec2 b) { return vec2(greater(a.x, b.x), greater(a.y, b.y)); }
vec3 lesser(vec3 a, vec3 b) { return vec3(lesser(a.xy, b.xy), lesser(a.z, b.z)); }
vec3 greater(vec3 a, vec3 b) { return vec3(greater(a.xy, b.xy), greater(a.z, b.z)); }

/// Reductions over a cluster, on all of its lanes.
#define DEFINE_CLUSTER_REDUCTION(NAME, TYPE, COMBINE)                               \
    TYPE NAME(TYPE x) {                                                             \
        x = COMBINE(x, subgroupShuffleXor(x, 1u));                                  \
        x = COMBINE(x, subgroupShuffleXor(x, 2u));                                  \
        if (kLanes >= 8u) x = COMBINE(x, subgroupShuffleXor(x, 4u));                \
        if (kLanes >= 16u) x = COMBINE(x, subgroupShuffleXor(x, 8u));               \
        return x;                                                                   \
    }
uint bitwise_or(uint a, uint b) { return a | b; }
DEFINE_CLUSTER_REDUCTION(cluster_max, uint, max)
DEFINE_CLUSTER_REDUCTION(cluster_max, float, greater)
DEFINE_CLUSTER_REDUCTION(cluster_min, float, lesser)
DEFINE_CLUSTER_REDUCTION(cluster_or, uint, bitwise_or)

#endif  // SHADERS_BASE_CLUSTER_GLSL
