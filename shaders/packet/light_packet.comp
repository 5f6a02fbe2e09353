// Traces the shadow rays of a region, which share the light as their origin, with a packet of 16x8
// or 16x16 pixels a cluster. Rays that have too little in common with the others are left to
// `resume`.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/base/exact.glsl"
#include "shaders/kernel_interface.h"

#ifdef LIGHT_PACKET_HEIGHT
const uint kPacketHeight = LIGHT_PACKET_HEIGHT;
#else
layout(constant_id = kConstantPacketHeight) const uint kPacketHeight = kLightPacketHeight;
#endif
#define PACKET_HEIGHT kPacketHeight
#define PACKET_ON_GRID false
#include "shaders/packet/packet_traversal.glsl"
#include "shaders/packet/light_packet_axes.glsl"
#include "shaders/packet/light_packet_rays.glsl"
#include "shaders/base/spread.glsl"
#include "shaders/single_ray/work.glsl"

layout(local_size_x = kGroupSize) in;
layout(constant_id = kConstantPacketRun) const uint kPacketRun = 1u;

/// The host sets it to 0.
layout(std430, binding = kBindOcclusion) writeonly buffer Occlusion { uint occlusion[]; };

/// Iterations that a round costs and no loop counts.
const uint kRoundSteps = 8u;
/// Steps of a packet. A packet that takes more has rays with little in common, for which `resume`
/// is faster.
const uint kMostSteps = 6000u;
/// The number of packets that the rays of these pixels may be divided into.
const uint kMaxRounds = 4u;

/// The places of the rays in the packet's plane, and 1/z at their ends, or kDone for rays that are
/// done.
float plane_x[kVectors];
float plane_y[kVectors];
float q_end[kVectors];
/// Bound of the error of q_end, including the rounding of directions.
float end_error;

/// Makes a packet of waiting rays. Its plane is that of the largest component of one of them,
/// sheared so that this ray passes it at 0. The packet takes the rays that pass near this ray,
/// compared with its neighbours in the image, since rays across the edge of a surface lie far
/// apart; is_last: it takes all rays. Rays whose z is below 0.5 are left out. Triangles are
/// set up along plane_axes; boxes are tested against wedges by a rectangle along the axes of space.
void set_frame(bool is_last) {
    uint v = uint(findLSB(cluster_or(waiting))) & (kVectors - 1u);
    uint lanes = cluster_or((waiting >> v & 1u) != 0u ? 1u << lane : 0u);
    uint axis_lane = uint(findLSB(lanes)) & (kLanes - 1u);
    vec3 own_dir = any_ray_of(v).dir;
    vec3 axis_dir = read_lane(own_dir, axis_lane);
    vec3 sizes = abs(axis_dir);
    uint axis = sizes.x >= sizes.y && sizes.x >= sizes.z ? 0u : sizes.y >= sizes.z ? 1u : 2u;
    vec3 d = rotate_axes(axis_dir, axis);
    float side = d.z < 0.0f ? -1.0f : 1.0f;
    vec2 shear = d.z == 0.0f ? vec2(0.0f) : d.xy / d.z;
    vec3 own = rotate_axes(own_dir, axis);
    vec2 own_point = abs(sheared_point(own, shear, own.z == 0.0f ? 0.0f : 1.0f / own.z));
    bool is_neighbour = (lanes >> lane & 1u) != 0u && lane != axis_lane;
    float spacing = cluster_min(is_neighbour ? greater(own_point.x, own_point.y) : 1.0f);
    float radius = is_last ? 1.0e30f : (PACKET_HEIGHT == 8u ? 32.0f : 64.0f) * spacing;

    traced = 0u;
    float most_q = 0.0f;
    float most_at = 0.0f;
    PointSums sums = no_points();
    [[unroll]] for (uint k = 0u; k < kVectors; ++k) {
        vec3 r = rotate_axes(vec3(dir_x[k], dir_y[k], dir_z[k]), axis);
        float z = side * r.z;
        bool is_traced = (waiting >> k & 1u) != 0u;
        bool is_out = is_traced && z < 0.5f;
        left_out |= is_out ? 1u << k : 0u;
        float rz = is_traced && !is_out ? 1.0f / z : 0.0f;
        vec2 at = sheared_point(r, shear, rz);
        float size = greater(abs(at.x), abs(at.y));
        is_traced = is_traced && !is_out && size <= radius;
        traced |= is_traced ? 1u << k : 0u;
        plane_x[k] = at.x;
        plane_y[k] = at.y;
        float q = rz / (is_traced ? tfar[k] : 1.0f);
        most_q = greater(most_q, is_traced ? q : 0.0f);
        most_at = greater(most_at, is_traced ? size : 0.0f);
        q_end[k] = is_traced ? q : kDone;
        add_point(sums, k, at, is_traced);
    }
    end_error = kEndError * cluster_max(most_q);
    waiting &= ~(traced | left_out);
    mat2 axes = plane_axes(sums);
    vec2 low = vec2(1.0e30f);
    vec2 high = vec2(-1.0e30f);
    [[unroll]] for (uint k = 0u; k < kVectors; ++k) {
        vec2 at = vec2(plane_x[k], plane_y[k]);
        bool is_traced = (traced >> k & 1u) != 0u;
        low = is_traced ? lesser(low, at) : low;
        high = is_traced ? greater(high, at) : high;
        plane_x[k] = dot(axes[0], at);
        plane_y[k] = dot(axes[1], at);
    }
    float at_error = point_error(cluster_max(most_at));
    vec2 box_low = vec2(cluster_min(low.x), cluster_min(low.y)) - at_error;
    vec2 box_high = vec2(cluster_max(high.x), cluster_max(high.y)) + at_error;
    low = vec2(1.0e30f);
    high = vec2(-1.0e30f);
    [[unroll]] for (uint g = 0u; g < kGroups; ++g) {
        vec2 group_low = vec2(1.0e30f);
        vec2 group_high = vec2(-1.0e30f);
        [[unroll]] for (uint k = 0u; k < kGroupVectors; ++k) {
            uint v = vector_of(g, k);
            bool is_traced = (traced >> v & 1u) != 0u;
            vec2 at = vec2(plane_x[v], plane_y[v]);
            group_low = is_traced ? lesser(group_low, at) : group_low;
            group_high = is_traced ? greater(group_high, at) : group_high;
        }
        group_lower[g] = vec2(cluster_min(group_low.x), cluster_min(group_low.y));
        group_upper[g] = vec2(cluster_max(group_high.x), cluster_max(group_high.y));
        low = lesser(low, group_lower[g]);
        high = greater(high, group_upper[g]);
    }
    // A power of two, so that the packet measures 8 to 16 and scaling is exact.
    float extent = greater(greater(high.x - low.x, high.y - low.y), 9.5367431640625e-07f);
    float scale = 8.0f * scale_to_unit(extent);
    [[unroll]] for (uint k = 0u; k < kVectors; ++k) {
        plane_x[k] *= scale;
        plane_y[k] *= scale;
    }
    vec2 x_row = sheared_axis(axes[0], shear);
    vec2 y_row = sheared_axis(axes[1], shear);
    // Three times rotate_axes is the identity, so two undo one.
    uint back = axis == 0u ? 1u : axis == 1u ? 0u : 2u;
    frame.org = light;
    frame.row_x = scale * rotate_axes(vec3(axes[0], x_row.x), back);
    frame.row_y = scale * rotate_axes(vec3(axes[1], y_row.x), back);
    frame.row_z = rotate_axes(vec3(0.0f, 0.0f, side), back);
    frame.own_row = lane == 0u ? frame.row_x : lane == 1u ? frame.row_y : frame.row_z;
    float row_error = lane == 0u ? x_row.y : lane == 1u ? y_row.y : 0.0f;
    frame.own_row_error = rotate_axes(vec3(0.0f, 0.0f, scale * row_error), back);
    frame.row_shift = 0.0f;
    frame.row_size = vec3(scale * sum_of_abs(vec3(axes[0], x_row.x)),
                          scale * sum_of_abs(vec3(axes[1], y_row.x)), 1.0f);
    // 2^-18, for roundings of values up to 16.
    frame.ray_error = vec2(scale * at_error + 3.814697265625e-06f);
    frame.lower = scale * low - frame.ray_error;
    frame.upper = scale * high + frame.ray_error;
    [[unroll]] for (uint g = 0u; g < kGroups; ++g) {
        group_lower[g] = scale * group_lower[g] - frame.ray_error;
        group_upper[g] = scale * group_upper[g] + frame.ray_error;
    }
    frame.depth_error = depth_margin(light);
    float unit = 1.0f / (scale * (axes[0].x * axes[1].y - axes[0].y * axes[1].x));
    set_directions(vec3(shear, 1.0f), unit * vec3(axes[1].y, -axes[1].x, 0.0f),
                   unit * vec3(-axes[0].y, axes[0].x, 0.0f), greater(frame.upper, -frame.lower));
    // In the axes of `rotate_axes` a ray at (x, y) of the plane has the direction
    // side * (shear, 1) + (x, y, 0), whose largest component is 1 or more.
    vec3 corners[4];
    [[unroll]] for (uint k = 0u; k < 4u; ++k) {
        vec2 at = vec2((k & 1u) != 0u ? box_high.x : box_low.x,
                       (k & 2u) != 0u ? box_high.y : box_low.y);
        corners[k] = rotate_axes(vec3(side * shear + at, side), back);
    }
    vec2 farthest = abs(shear) + greater(abs(box_low), abs(box_high));
    set_planes(corners, greater(1.0f, greater(farthest.x, farthest.y)), 1.0f);
    frame.rounding = kShadowRounding;
}

void trace_triangle(uint group, Setup s, uint name, uint bit) {
    [[unroll]] for (uint k = 0u; k < kGroupVectors; ++k) {
        uint v = vector_of(group, k);
        float x = plane_x[v];
        float y = plane_y[v];
        vec3 e = s.a * x + s.b * y + s.c;
        float before_end = s.q.x * x + s.q.y * y + s.q.z - q_end[v];
        float inside = lesser(e.x, lesser(e.y, e.z));
        bool is_possible = inside >= -s.bound && before_end >= -s.q_error;
        bool is_sure = is_possible && inside > s.bound && before_end > s.q_error;
        pending_deferred[group] |= is_possible && !is_sure ? bit << (k * kLanes) : 0u;
        q_end[v] = is_sure ? kDone : q_end[v];
    }
}

void add_ray_error(inout Setup s) { s.q_error += end_error; }

float least_q(uint group) {
    float least = q_end[vector_of(group, 0u)];
    [[unroll]] for (uint k = 1u; k < kGroupVectors; ++k) {
        least = lesser(least, q_end[vector_of(group, k)]);
    }
    // Not negative, since keys are compared as bits.
    return least < kDone ? greater(least - end_error, 0.0f) : kDone;
}

/// Applies the rule to all deferred pairs, one of each lane at a time.
void resolve_deferred(inout Traversal t) {
    bool more = true;
    do {
        bool is_any = deferred_vectors[0] != 0u;
        uint name;
        uint v = pop_deferred(true, name);
        Ray ray = any_ray_of(v);
        vec3 a, b, c;
        named_triangle(is_any ? name : 0u, a, b, c);
        TriangleHit hit;
        bool is_hit =
            intersect_triangle(shear_ray(ray.org, ray.dir), ray.tnear, ray.tfar, a, b, c, hit);
        is_hit = is_hit && is_any;
        [[unroll]] for (uint k = 0u; k < kVectors; ++k) {
            q_end[k] = is_hit && k == v ? kDone : q_end[k];
        }
        more = cluster_or(deferred_vectors[0]) != 0u;
        ++t.steps;
    } while (more && t.steps < t.most_steps);
}

void write_answers() {
    uint any = cluster_or(shadowed);
    do {
        uint v = uint(findLSB(any)) & (kVectors - 1u);
        if ((shadowed >> v & 1u) != 0u) occlusion[answer_index(ray_pixel(v))] = 1u;
        any &= any - 1u;
    } while (any != 0u);
    uint rest = cluster_or(left_out);
    do {
        uint v = uint(findLSB(rest)) & (kVectors - 1u);
        if ((left_out >> v & 1u) != 0u) suspend(any_ray_of(v), answer_index(ray_pixel(v)));
        rest &= rest - 1u;
    } while (rest != 0u);
}

void main() {
    find_lane();
    uint group = spread_group(gl_WorkGroupID.x, gl_NumWorkGroups.x);
    uint cluster = group * (kGroupSize / kLanes) + gl_SubgroupID * (gl_SubgroupSize / kLanes) +
                   gl_SubgroupInvocationID / kLanes;
    uint packet = cluster * kPacketRun;
    uint end = min(packet + kPacketRun, args.tile_count);
    if (packet >= end) return;
    read_arguments();
    Traversal t;
    t.steps = 0u;
    do {
        uint visible = 0u;
        uint any = 0u;
        do {
            // Always true, but see cluster.glsl.
            if (any == 0u) {
                packet_origin = uvec2(packet % args.tile_columns, packet / args.tile_columns) *
                                uvec2(kPacketWidth, PACKET_HEIGHT);
                visible = find_visible();
                any = cluster_or(visible);
            }
            ++packet;
        } while (any == 0u && packet < end);
        make_rays(visible);
        uint round = 0u;
        do {
            ++round;
            set_frame(round == kMaxRounds);
            begin_traversal();
            update_depth();
            t.most_steps = min(t.steps + kMostSteps, kSteps);
            t.current = cluster_or(traced) != 0u ? 0u : kEmptyChild;
            t.triangles = kAllTriangles;
            clear_pending();
            do {
                t.steps += kRoundSteps;
                traverse(t);
                resolve_deferred(t);
            } while (!is_finished(t) && t.steps < t.most_steps && level <= kMaxDepth);
            [[unroll]] for (uint v = 0u; v < kVectors; ++v) {
                shadowed |= q_end[v] == kDone ? traced & (1u << v) : 0u;
            }
            bool is_complete = is_finished(t) && t.steps < t.most_steps;
            if (!is_complete) left_out |= traced & ~shadowed;
        } while (cluster_or(waiting) != 0u && round < kMaxRounds);
        write_answers();
    } while (packet < end);
}
