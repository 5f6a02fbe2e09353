// Traces ambient-occlusion rays, 32 rays of neighbouring pixels a cluster.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/base/exact.glsl"

#include "shaders/base/found_hits.glsl"
#include "shaders/occlusion/near_leaf.glsl"
#include "shaders/shade/pixel_surface.glsl"
#include "shaders/base/spread.glsl"
#include "shaders/single_ray/work.glsl"

layout(local_size_x = kGroupSize) in;
layout(constant_id = kConstantStepBudget) const uint kSteps = kPacketStepBudget;
layout(constant_id = kConstantPacketRun) const uint kRun = 1u;

layout(push_constant) uniform Arguments { OcclusionArguments args; };
layout(binding = kBindVisiblePixels) uniform usamplerBuffer visible_pixels;
layout(std430, binding = kBindOcclusion) buffer Occlusion { uint occlusion[]; };

/// The indices of the rays' pixels within the region.
uint pixels[kVectors];

/// Makes rays [first, first + kPacketRays), up to the last ray.
void make_rays(uint first) {
    uint own = 0u;
    float largest = 0.0f;
    [[unroll]] for (uint k = 0u; k < kVectors; ++k) {
        uint number = first + k * kLanes + lane;
        bool is_any = number < args.ray_end;
        number = is_any ? number : first;
        pixels[k] = texelFetch(visible_pixels, int(number / args.params.ao_count)).x;
        uint x = args.x + pixels[k] % args.width;
        uint y = args.y + pixels[k] / args.width;
        Hit hit = found_hit(pixels[k]);
        Surface s = pixel_surface(camera_ray(args.params.camera, x, y), hit,
                                  scene_triangle(hit.prim_id));
        set_ray(k, ao_ray(s, x, y, number % args.params.ao_count, args.params.ao_tfar));
        largest = greater(largest, common_dilation(orgs[k]));
        own |= is_any ? 1u << (k * kLanes + lane) : 0u;
    }
    alive = cluster_or(own);
    dilation = cluster_max(largest);
    centre = read_lane(orgs[0], 0u);
    float farthest = 0.0f;
    [[unroll]] for (uint k = 0u; k < kVectors; ++k) {
        farthest = greater(farthest, sum_of(orgs[k] - centre));
    }
    spread = cluster_max(farthest);
}

void trace(inout uint steps) {
    level = 0u;
    current = 0u;
    current_rays = alive;
    [[unroll]] for (uint k = 0u; k < kSlots; ++k) waiting[k] = 0u;
    [[unroll]] for (uint h = 0u; h < kSlots; ++h) uncertain[h] = 0u;
    deferred_count = 0u;
    node = 0u;
    do {
        do {
            // kEmptyChild has kLeafBit set.
            do {
                if ((current & kLeafBit) == 0u) {
                    visit_node(steps);
                    take_child(steps);
                }
            } while ((current & kLeafBit) == 0u && level <= kMaxDepth);
            do {
                if ((current & kLeafBit) != 0u && current != kEmptyChild && has_room()) {
                    visit_leaf(steps);
                    note_uncertain(steps);
                    take_child(steps);
                }
            } while ((current & kLeafBit) != 0u && current != kEmptyChild && has_room() &&
                     steps < kSteps);
            // Includes the iterations that the inner loops run once without work.
            steps += 8u;
        } while (current != kEmptyChild && has_room() && steps < kSteps);
        resolve_deferred();
        note_uncertain(steps);
    } while ((current != kEmptyChild || deferred_count != 0u) && steps < kSteps &&
             level <= kMaxDepth);
}

/// Counts the occluded rays. If the trace is not complete, leaves the other rays to `resume`.
void finish_rays(uint all, bool is_complete) {
    [[unroll]] for (uint k = 0u; k < kVectors; ++k) {
        uint bit = 1u << (k * kLanes + lane);
        if ((all & ~alive & bit) != 0u) atomicAdd(occlusion[pixels[k]], 1u);
        Ray ray;
        ray.org = orgs[k];
        ray.tnear = 0.0f;
        ray.dir = dirs[k];
        ray.tfar = tfars[k];
        if (!is_complete && (alive & bit) != 0u) suspend(ray, pixels[k]);
    }
}

void main() {
    find_lane();
    uint group = spread_group(gl_WorkGroupID.x, gl_NumWorkGroups.x);
    uint cluster = group * (kGroupSize / kLanes) + gl_SubgroupID * (gl_SubgroupSize / kLanes) +
                   gl_SubgroupInvocationID / kLanes;
    uint at = args.ray_first + cluster * kRun * kPacketRays;
    uint end = min(at + kRun * kPacketRays, args.ray_end);
    if (at >= end) return;
    uint steps = 0u;
    do {
        make_rays(at);
        uint all = alive;
        if (steps < kSteps) trace(steps);
        bool is_complete = steps < kSteps && level <= kMaxDepth;
        finish_rays(all, is_complete);
        at += kPacketRays;
    } while (at < end);
}
