// Ambient occlusion: up to 16 rays of a pixel, which all start at one point, a pixel a cluster of
// lanes.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/exact.glsl"

#include "shaders/found_hits.glsl"
#include "shaders/pixel_surface.glsl"
#include "shaders/point_leaf.glsl"
#include "shaders/spread.glsl"
#include "shaders/work.glsl"

layout(local_size_x = kGroupSize) in;
layout(constant_id = kConstantStepBudget) const uint kSteps = kPacketStepBudget;
layout(constant_id = kConstantPacketRun) const uint kRun = 1u;

layout(push_constant) uniform Arguments { OcclusionArguments args; };
layout(binding = kBindSeen) uniform usamplerBuffer seen;
layout(std430, binding = kBindOcclusion) buffer Occlusion { uint occlusion[]; };

/// The pixel, among those of the region.
uint pixel_index;

void make_rays(uint index) {
    pixel_index = texelFetch(seen, int(index)).x;
    uint x = args.x + pixel_index % args.width;
    uint y = args.y + pixel_index / args.width;
    Hit hit = found_hit(pixel_index);
    Surface s = pixel_surface(camera_ray(args.params.camera, x, y), hit,
                              scene_triangle(hit.prim_id));
    uint own = 0u;
    [[unroll]] for (uint k = 0u; k < kSlots; ++k) {
        uint number = k * kLanes + lane;
        Ray ray = ao_ray(s, x, y, args.sample_index + number, args.params.ao_tfar);
        org = ray.org;
        dirs[k] = ray.dir;
        tfars[k] = ray.tfar;
        rdirs[k] = vec3(slab_reciprocal(ray.dir.x), slab_reciprocal(ray.dir.y),
                        slab_reciprocal(ray.dir.z));
        own |= args.sample_index + number < args.params.ao_count ? 1u << number : 0u;
    }
    alive = cluster_or(own);
}

void trace(inout uint steps) {
    level = 0u;
    current = 0u;
    current_rays = alive;
    [[unroll]] for (uint k = 0u; k < kSlots; ++k) waiting[k] = 0u;
    [[unroll]] for (uint h = 0u; h < kSlots; ++h) doubtful[h] = 0u;
    doubt_count = 0u;
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
                    note_doubts(steps);
                    take_child(steps);
                }
            } while ((current & kLeafBit) != 0u && current != kEmptyChild && has_room());
            steps += 2u;
        } while (current != kEmptyChild && has_room() && steps < kSteps);
        settle_doubts();
        note_doubts(steps);
    } while ((current != kEmptyChild || doubt_count != 0u) && steps < kSteps &&
             level <= kMaxDepth);
}

/// Rays that are left are traced by `resume`.
void leave_out() {
    [[unroll]] for (uint k = 0u; k < kSlots; ++k) {
        Ray ray;
        ray.org = org;
        ray.tnear = 0.0f;
        ray.dir = dirs[k];
        ray.tfar = tfars[k];
        if ((alive >> (k * kLanes + lane) & 1u) != 0u) suspend(ray, pixel_index);
    }
}

void main() {
    find_lane();
    uint group = spread_group(gl_WorkGroupID.x, gl_NumWorkGroups.x);
    uint cluster = group * (kGroupSize / kLanes) + gl_SubgroupID * (gl_SubgroupSize / kLanes) +
                   gl_SubgroupInvocationID / kLanes;
    uint at = args.seen_first + cluster * kRun;
    uint end = min(at + kRun, args.seen_end);
    if (at >= end) return;
    uint steps = 0u;
    do {
        make_rays(at);
        uint all = alive;
        if (steps < kSteps) trace(steps);
        bool is_complete = steps < kSteps && level <= kMaxDepth;
        uint count = uint(bitCount(all & ~alive));
        if (lane == 0u && count != 0u) occlusion[pixel_index] += count;
        if (!is_complete) leave_out();
        ++at;
    } while (at < end);
}
