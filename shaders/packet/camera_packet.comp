// Finds the closest hit of each camera ray of a region, with a packet of 16x16 pixels a cluster.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/base/exact.glsl"

#include "common/interop/camera.h"
#define PACKET_HEIGHT (kLanes == 4u ? 8u : kCameraPacketHeight)
#define PACKET_ON_GRID true
#include "shaders/packet/packet_traversal.glsl"
#include "shaders/packet/finish_hit.glsl"
#include "shaders/packet/packet_pixels.glsl"
#include "shaders/base/spread.glsl"

layout(local_size_x = kGroupSize) in;

layout(push_constant) uniform Arguments { PacketArguments args; };
/// Hits as vectors, which some devices store and load faster than structures.
layout(std430, binding = kBindHits) buffer Hits { uvec4 hits[]; };
layout(std430, binding = kBindWork) buffer Work { WorkHeader header; } work;

/// Iterations that a round costs and no loop counts.
const uint kRoundSteps = 8u;
const uint kAllVectors = 0xFFFFFFFFu >> (32u - kVectors);

/// 1/z of the closest candidates, and a bound of their errors.
float best_q[kVectors];
float best_error;
uint candidates[kVectors];

// One bit for each vector of this lane's rays: rays whose candidate the rule's fast path could not
// finish, and rays that have a hit in `hits`.
uint unfinished;
uint written;

layout(constant_id = kConstantPacketRun) const uint kPacketRun = 1u;

Camera camera;

/// Copies the arguments that all rays need (packet_pixels.glsl says why).
void read_arguments() {
    camera = args.camera;
    region_origin = uvec2(args.x, args.y);
    region_size = uvec2(args.width, args.height);
}

Ray ray_of(uvec2 pixel) {
    return camera_ray(camera, region_origin.x + pixel.x, region_origin.y + pixel.y);
}

float magnitude_sum(vec3 v) { return abs(v.x) + abs(v.y) + abs(v.z); }

/// Moves a row of the image's frame to the packet's frame: returns row - middle * row_z, and its
/// rounding error in row_error.
vec3 move_row(vec3 row, vec3 row_z, float middle, out vec3 row_error) {
    precise vec3 product = middle * row_z;
    precise vec3 moved = row - product;
    precise vec3 error = vec3(difference_error(row.x, product.x, moved.x),
                              difference_error(row.y, product.y, moved.y),
                              difference_error(row.z, product.z, moved.z));
    error = error - vec3(product_error(middle, row_z.x, product.x),
                         product_error(middle, row_z.y, product.y),
                         product_error(middle, row_z.z, product.z));
    row_error = error;
    return moved;
}

/// Bound of the distance of a ray from the middle of its pixel, in x and y.
///
/// 1. A component of a direction, (corner + du x) + dv y, takes two products and two sums, each off
///    by 2^-24 of its result, and is put on a grid, off by 2^-45 of the largest.
/// 2. The rows from the host are off by 2^-24 of their components, and the middle times that of
///    row_z.
/// 3. In the frame's rows these errors are e = (e0, e1, e2). A ray at (X, Y, 1) is off by
///    (e0 - X e2) / (1 + e2) in x, and likewise in y.
/// 4. The factors of the code cover roundings here and the division by 1 + e2.
vec2 find_ray_error(vec3 row_x, vec3 row_y, vec2 middle) {
    vec3 du = abs(camera.du);
    vec3 dv = abs(camera.dv);
    vec3 before = camera.corner + middle.x * camera.du;
    vec3 size = abs(before + middle.y * camera.dv) + 8.0f * (du + dv);
    vec3 sums = abs(before) + 8.0f * du + size;
    vec3 products = (middle.x + 8.0f) * du + (middle.y + 8.0f) * dv;
    // The grid: 2^-44.
    vec3 error = kDirectionRounding *
                 (products + sums + 9.5367431640625e-07f * largest_component(size));
    vec3 given = kDirectionRounding * size;
    vec3 along = abs(frame.row_z);
    float e2 = dot(along, error + given);
    float e0 = dot(abs(frame.row_x), error) + dot(abs(row_x) + middle.x * along, given);
    float e1 = dot(abs(frame.row_y), error) + dot(abs(row_y) + middle.y * along, given);
    vec2 off = vec2(e0, e1) + 9.0f * e2;
    // has_packet_frame() (gpu/packet_arguments.h) keeps e2 below 2^-7. A ray that is off by more
    // than 8 pixels has no bound in x and y.
    return greater(off.x, off.y) <= 8.0f ? off : vec2(1.0e9f);
}

/// The unit of the packet's plane is a pixel, its origin the middle of the packet. Rays are taken
/// for the middles of their pixels.
void set_frame() {
    vec2 middle = vec2(region_origin + packet_origin + uvec2(kPacketWidth, PACKET_HEIGHT) / 2u);
    vec3 row_x = vec3(args.row_x[0], args.row_x[1], args.row_x[2]);
    vec3 row_y = vec3(args.row_y[0], args.row_y[1], args.row_y[2]);
    vec3 row_z = vec3(args.row_z[0], args.row_z[1], args.row_z[2]);
    vec3 x_error, y_error;
    frame.org = camera.org;
    frame.row_x = move_row(row_x, row_z, middle.x, x_error);
    frame.row_y = move_row(row_y, row_z, middle.y, y_error);
    frame.row_z = row_z;
    frame.own_row = lane == 0u ? frame.row_x : lane == 1u ? frame.row_y : row_z;
    frame.own_row_error = lane == 0u ? x_error : lane == 1u ? y_error : vec3(0.0f);
    frame.row_size =
        vec3(magnitude_sum(frame.row_x), magnitude_sum(frame.row_y), magnitude_sum(row_z));
    // The products of move_row are off by u, less than 0.07 of kExtentError.
    frame.row_shift = 0.07f * (middle.x + middle.y) * frame.row_size.z;
    frame.ray_error = find_ray_error(row_x, row_y, middle);
    set_directions(camera.corner + middle.x * camera.du + middle.y * camera.dv, camera.du,
                   camera.dv, vec2(9.0f));
    vec2 extent = vec2(7.5f, float(kGroups) - 0.5f) + frame.ray_error;
    frame.lower = -extent;
    frame.upper = extent;
    frame.depth_error = depth_margin(frame.org) * max(frame.row_size.z, 1.0f);
    frame.rounding = kCameraRounding;
}

/// The packet's corners are the middles of its corner pixels.
void set_sides() {
    vec2 middle = vec2(region_origin + packet_origin + uvec2(kPacketWidth, PACKET_HEIGHT) / 2u);
    vec3 at = camera.corner + middle.x * camera.du + middle.y * camera.dv;
    vec2 extent = vec2(7.5f, float(kGroups) - 0.5f);
    vec3 corners[4];
    [[unroll]] for (uint k = 0u; k < 4u; ++k) {
        corners[k] = at + ((k & 1u) != 0u ? extent.x : -extent.x) * camera.du +
                     ((k & 2u) != 0u ? extent.y : -extent.y) * camera.dv;
    }
    vec3 sizes = abs(camera.corner) + (middle.x + 8.0f) * abs(camera.du) +
                 (middle.y + 8.0f) * abs(camera.dv);
    // row_z d = 1, so that the largest component of d is at least 1 over the size of row_z.
    set_planes(corners, largest_component(sizes), 0.999f / frame.row_size.z);
}

void begin_packet(uint packet) {
    packet_origin = uvec2(packet % args.tile_columns, packet / args.tile_columns) *
                    uvec2(kPacketWidth, PACKET_HEIGHT);
    set_frame();
    set_sides();
    begin_traversal();
}

void begin_rays() {
    [[unroll]] for (uint v = 0u; v < kVectors; ++v) {
        best_q[v] = is_active(ray_pixel(v)) ? 0.0f : kDone;
        candidates[v] = kNoTriangle;
    }
    best_error = 0.0f;
    unfinished = 0u;
    written = 0u;
    clear_pending();
}

void trace_triangle(uint group, Setup s, uint name, uint bit) {
    float x = float(lane & 3u) - 7.5f + 8.0f * float(group & 1u);
    float y = float(lane >> 2u) + 0.5f - float(kGroups) + 4.0f * float(group >> 1u);
    vec3 row = s.a * x + s.b * y + s.c;
    float row_q = s.q.x * x + s.q.y * y + s.q.z;
    [[unroll]] for (uint k = 0u; k < kGroupVectors; ++k) {
        uint v = vector_of(group, k);
        vec3 e = row;
        float q = row_q;
        if ((k & 1u) != 0u) {
            e += 4.0f * s.a;
            q += 4.0f * s.q.x;
            row += float(kVectorHeight) * s.b;
            row_q += float(kVectorHeight) * s.q.y;
        }
        float least = lesser(e.x, lesser(e.y, e.z));
        float nearer = q - best_q[v];
        bool sure = least > s.bound && nearer > s.sure_error;
        bool possible = least >= -s.bound && nearer >= -s.q_error;
        pending_deferred[group] |= possible && !sure ? bit << (k * kLanes) : 0u;
        best_q[v] = sure ? q : best_q[v];
        candidates[v] = sure ? name : candidates[v];
    }
}

void add_ray_error(inout Setup s) {
    best_error = greater(best_error, cluster_max(s.sure_error < kDone ? s.sure_error : 0.0f));
    s.q_error += best_error;
    s.sure_error += best_error;
}

float least_q(uint group) {
    float least = best_q[vector_of(group, 0u)];
    [[unroll]] for (uint k = 1u; k < kGroupVectors; ++k) {
        least = lesser(least, best_q[vector_of(group, k)]);
    }
    return greater(least - best_error, 0.0f);
}

uvec4 hit_words(TriangleHit hit, uint prim_id) {
    return uvec4(floatBitsToUint(hit.t), floatBitsToUint(hit.u), floatBitsToUint(hit.v), prim_id);
}

/// Writes misses for this lane's rays of `vectors`, without those of `excluded` (both as bits).
void write_misses(uint vectors, uint excluded, uint prim_id) {
    do {
        uint v = uint(findLSB(vectors)) & (kVectors - 1u);
        uvec2 pixel = ray_pixel(v);
        if (((vectors & ~excluded) >> v & 1u) != 0u && is_active(pixel)) {
            hits[answer_index(pixel)] = uvec4(0u, 0u, 0u, prim_id);
        }
        vectors &= vectors - 1u;
    } while (vectors != 0u);
}

/// candidates[4 * row + i]. An array with such an index would be slow wherever it is used.
uint candidate_of(uint row, uint i) {
    uint name = candidates[i];
    [[unroll]] for (uint r = 1u; r < kRows; ++r) name = row == r ? candidates[4u * r + i] : name;
    return name;
}

uint any_candidate_of(uint v) {
    uint name = candidates[0];
    [[unroll]] for (uint k = 1u; k < kVectors; ++k) name = v == k ? candidates[k] : name;
    return name;
}

/// Writes t, u and v of the candidates by the rule's fast path. A candidate stays unfinished if the
/// rule may not take that path, or if the ray has a hit from a deferred triangle already.
void finish_candidates() {
    uint own = 0u;
    [[unroll]] for (uint v = 0u; v < kVectors; ++v) {
        own |= candidates[v] != kNoTriangle ? 1u << v : 0u;
    }
    uint any = cluster_or(own);
    // The vectors of rows with a candidate.
    uint rows = ((any | any >> 1u | any >> 2u | any >> 3u) & 0x11111111u) * kFirstRow;
    uint resolved = written;
    uint left = any;
    do {
        uint row = (uint(findLSB(left)) & (kVectors - 1u)) >> 2u;
        [[unroll]] for (uint i = 0u; i < 4u; ++i) {
            uint v = 4u * row + i;
            uvec2 pixel = ray_pixel(v);
            Ray ray = ray_of(pixel);
            bool is_hit = (own >> v & 1u) != 0u;
            bool is_new = (resolved >> v & 1u) == 0u;
            vec3 a, b, c;
            uint prim_id = named_triangle(is_hit ? candidate_of(row, i) : 0u, a, b, c);
            ShearedRay sheared = shear_ray(ray.org, ray.dir);
            TriangleHit hit;
            bool is_sure = finish_hit(sheared, project_fast(sheared, a), project_fast(sheared, b),
                                      project_fast(sheared, c), hit);
            is_sure = is_sure && is_hit && is_new;
            unfinished |= is_hit && !is_sure ? 1u << v : 0u;
            written |= is_sure ? 1u << v : 0u;
            uvec4 words = is_sure ? hit_words(hit, prim_id) : uvec4(0u, 0u, 0u, kNoPrim);
            if (left != 0u && is_new && is_active(pixel)) hits[answer_index(pixel)] = words;
        }
        left &= ~(kFirstRow << (4u * row));
    } while (left != 0u);
    write_misses(kAllVectors & ~rows, resolved, kNoPrim);
}

/// Applies the rule to all deferred pairs and unfinished candidates, one of each lane at a time, as
/// long as there are steps.
void resolve_deferred(inout uint steps) {
    bool more = true;
    do {
        bool is_candidate = unfinished != 0u;
        uint name;
        bool is_any = is_candidate || deferred_vectors[0] != 0u;
        uint v = pop_deferred(!is_candidate, name);
        v = is_candidate ? uint(findLSB(unfinished)) & (kVectors - 1u) : v;
        name = is_candidate ? any_candidate_of(v) : name;
        unfinished &= unfinished - 1u;
        uvec2 pixel = ray_pixel(v);
        Ray ray = ray_of(pixel);
        vec3 a, b, c;
        uint prim_id = named_triangle(is_any ? name : 0u, a, b, c);
        TriangleHit hit;
        bool is_hit =
            intersect_triangle(shear_ray(ray.org, ray.dir), ray.tnear, ray.tfar, a, b, c, hit);
        if (is_any && is_hit) {
            uint index = answer_index(pixel);
            uvec4 best = hits[index];
            bool is_first = (written >> v & 1u) == 0u;
            if (is_first || is_closer(hit.t, prim_id, uintBitsToFloat(best.x), best.w)) {
                hits[index] = hit_words(hit, prim_id);
            }
            written |= 1u << v;
        }
        more = cluster_or(unfinished | deferred_vectors[0]) != 0u;
        ++steps;
    } while (more && steps < kSteps);
}

/// Finds the first packet of the run that meets a child of the root, and visits the root. Writes
/// misses for the packets before it.
void find_packet(inout uint packet, uint end, inout uint steps) {
    bool is_met = false;
    do {
        // Always true, but see cluster.glsl.
        if (!is_met) {
            begin_packet(packet);
            visit_node(0u);
            uint any = 0u;
            [[unroll]] for (uint k = 0u; k < kSlots; ++k) any |= keys[k];
            is_met = cluster_or(any) != 0u;
            write_misses(is_met ? 0u : kAllVectors, 0u, kNoPrim);
        }
        ++packet;
        ++steps;
    } while (!is_met && packet < end);
}

/// Each cluster has a run of packets. So packets that meet nothing end before the bodies of the
/// loops that follow, and packets without deferred pairs before that of the rule.
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
    t.current = kEmptyChild;
    t.triangles = kAllTriangles;
    t.steps = 0u;
    t.most_steps = kSteps;
    clear_pending();
    bool is_complete = true;
    bool is_done = false;
    do {
        bool is_resolved = false;
        do {
            if (is_finished(t)) {
                find_packet(packet, end, t.steps);
                begin_rays();
                t.current = take_child(t.steps);
                t.triangles = kAllTriangles;
            }
            // The loops that a round runs once without counting.
            t.steps += kRoundSteps;
            traverse(t);
            if (is_finished(t)) finish_candidates();
            is_resolved = cluster_or(unfinished | deferred_vectors[0]) == 0u;
            is_complete = t.steps < kSteps && level <= kMaxDepth;
            is_done = is_finished(t) && packet >= end;
        } while (is_resolved && is_complete && !is_done);
        resolve_deferred(t.steps);
        is_complete = is_complete && t.steps < kSteps;
    } while (is_complete && !is_done);
    if (is_complete) return;
    atomicOr(work.header.status, kStatusUnfinished);
    --packet;
    do {
        begin_packet(packet);
        write_misses(kAllVectors, 0u, kUnfinishedPrim);
        ++packet;
    } while (packet < end);
}
