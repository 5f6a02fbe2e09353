// The shadow rays of a region, which all start at the light: a packet of 16x8 pixels a cluster of
// lanes. Rays that have too little in common with the others, or two doubts, are left to `resume`.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/exact.glsl"

#define PACKET_ON_GRID false
#include "shaders/found_hits.glsl"
#include "shaders/packet_traversal.glsl"
#include "shaders/pixel_surface.glsl"
#include "shaders/spread.glsl"
#include "shaders/work.glsl"

layout(local_size_x = kGroupSize) in;
layout(constant_id = kConstantPacketRun) const uint kPacketRun = 1u;

layout(push_constant) uniform Arguments { RegionArguments args; };
/// Comes as 0.
layout(std430, binding = kBindOcclusion) writeonly buffer Occlusion { uint occlusion[]; };

/// Vectors of rays, 4 in a row, each 4 pixels wide and kVectorHeight high.
const uint kVectors = kPacketRays / kLanes;
const uint kVectorHeight = kLanes / 4u;
const uint kAllBits = 0xFFFFFFFFu;
/// Packets that the rays of 16x8 pixels may be divided into.
const uint kMaxRounds = 4u;

/// Directions and tfar; where the rays pass the packet's plane, and bounds of 1/z at their ends, or
/// kDone of those that want no more.
float dir_x[kVectors];
float dir_y[kVectors];
float dir_z[kVectors];
float tfar[kVectors];
float plane_x[kVectors];
float plane_y[kVectors];
float q_lower[kVectors];
float q_upper[kVectors];
/// Triangles in doubt, or kNoTriangle: mostly the one that the ray ends on, and near edges another.
uint doubts[kVectors];
uint second_doubts[kVectors];
// One bit for each vector of this lane's rays: those that wait for a packet, those of the packet,
// what is in shadow, and what is left to `resume`.
uint waiting;
uint traced;
uint shadowed;
uint left_out;

uvec2 packet_origin;  // its first pixel, in the region

// Arguments, read once: some devices read them lane by lane where control flow may diverge.
Camera camera;
vec3 light;
uvec2 region_origin;
uvec2 region_size;

void read_arguments() {
    camera = args.params.camera;
    light = args.params.light;
    region_origin = uvec2(args.x, args.y);
    region_size = uvec2(args.width, args.height);
}

uvec2 ray_pixel(uint v) {
    return packet_origin +
           uvec2(4u * (v & 3u) + (lane & 3u), kVectorHeight * (v >> 2u) + (lane >> 2u));
}

bool is_active(uvec2 pixel) { return pixel.x < region_size.x && pixel.y < region_size.y; }

uint answer_index(uvec2 pixel) { return pixel.y * region_size.x + pixel.x; }

/// Which vectors show something, on this lane.
uint find_seen() {
    uint seen = 0u;
    [[unroll]] for (uint v = 0u; v < kVectors; ++v) {
        uvec2 pixel = ray_pixel(v);
        uint index = is_active(pixel) ? answer_index(pixel) : 0u;
        bool is_seen = is_active(pixel) && found_hit(index).prim_id < kUnfinishedPrim;
        seen |= is_seen ? 1u << v : 0u;
    }
    return seen;
}

// Not dir_x[v] and so on: arrays that are indexed so are slow wherever they are used.

void set_ray(uint v, Ray ray) {
    [[unroll]] for (uint k = 0u; k < kVectors; ++k) {
        dir_x[k] = v == k ? ray.dir.x : dir_x[k];
        dir_y[k] = v == k ? ray.dir.y : dir_y[k];
        dir_z[k] = v == k ? ray.dir.z : dir_z[k];
        tfar[k] = v == k ? ray.tfar : tfar[k];
    }
}

Ray ray_of(uint v) {
    Ray ray;
    ray.org = light;
    ray.tnear = 0.0f;
    ray.dir = vec3(dir_x[0], dir_y[0], dir_z[0]);
    ray.tfar = tfar[0];
    [[unroll]] for (uint k = 1u; k < kVectors; ++k) {
        ray.dir.x = v == k ? dir_x[k] : ray.dir.x;
        ray.dir.y = v == k ? dir_y[k] : ray.dir.y;
        ray.dir.z = v == k ? dir_z[k] : ray.dir.z;
        ray.tfar = v == k ? tfar[k] : ray.tfar;
    }
    return ray;
}

uint doubt_of(uint v) {
    uint name = doubts[0];
    [[unroll]] for (uint k = 1u; k < kVectors; ++k) name = v == k ? doubts[k] : name;
    return name;
}

uint second_doubt_of(uint v) {
    uint name = second_doubts[0];
    [[unroll]] for (uint k = 1u; k < kVectors; ++k) name = v == k ? second_doubts[k] : name;
    return name;
}

void make_rays(uint seen) {
    waiting = 0u;
    shadowed = 0u;
    left_out = 0u;
    uint left = cluster_or(seen);
    do {
        uint v = uint(findLSB(left)) & (kVectors - 1u);
        bool is_seen = (seen >> v & 1u) != 0u;
        uvec2 pixel = ray_pixel(v);
        Hit hit = found_hit(is_seen ? answer_index(pixel) : 0u);
        hit.prim_id = is_seen ? hit.prim_id : 0u;
        Ray eye = camera_ray(camera, region_origin.x + pixel.x, region_origin.y + pixel.y);
        Surface s = pixel_surface(eye, hit, scene_triangle(hit.prim_id));
        bool faces = faces_light(s, light);
        waiting |= is_seen && faces ? 1u << v : 0u;
        shadowed |= is_seen && !faces ? 1u << v : 0u;
        set_ray(v, shadow_ray(s, light));
        left &= left - 1u;
    } while (left != 0u);
}

/// Where a direction passes the plane of a shear.
vec2 sheared_point(vec3 d, vec2 shear, float rz) {
    precise vec2 moved = d.xy - shear * d.z;
    return moved * rz;
}

/// The plane is that of the largest component of one of the waiting rays, sheared so that this ray
/// passes it at 0. The packet are those that pass near it, measured by its neighbours in the
/// picture: across the edge of a surface they lie far apart (is_last: all). Rays that hardly reach
/// the plane are left out.
void set_frame(bool is_last) {
    uint v = uint(findLSB(cluster_or(waiting))) & (kVectors - 1u);
    uint lanes = cluster_or((waiting >> v & 1u) != 0u ? 1u << lane : 0u);
    uint axis_lane = uint(findLSB(lanes)) & (kLanes - 1u);
    vec3 own_dir = ray_of(v).dir;
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
    float radius = is_last ? 1.0e30f : 32.0f * spacing;

    traced = 0u;
    vec2 low = vec2(1.0e30f);
    vec2 high = vec2(-1.0e30f);
    [[unroll]] for (uint k = 0u; k < kVectors; ++k) {
        vec3 r = rotate_axes(vec3(dir_x[k], dir_y[k], dir_z[k]), axis);
        float z = side * r.z;
        bool is_traced = (waiting >> k & 1u) != 0u;
        bool is_out = is_traced && z < 0.5f;
        left_out |= is_out ? 1u << k : 0u;
        float rz = is_traced && !is_out ? 1.0f / z : 0.0f;
        vec2 at = sheared_point(r, shear, rz);
        is_traced = is_traced && !is_out && greater(abs(at.x), abs(at.y)) <= radius;
        traced |= is_traced ? 1u << k : 0u;
        plane_x[k] = at.x;
        plane_y[k] = at.y;
        low = is_traced ? min(low, at) : low;
        high = is_traced ? max(high, at) : high;
        float q = rz / (is_traced ? tfar[k] : 1.0f);
        // 2^-18.
        q_lower[k] = is_traced ? q * 0.999996185302734375f : kDone;
        q_upper[k] = is_traced ? q * 1.000003814697265625f : kDone;
        doubts[k] = kNoTriangle;
        second_doubts[k] = kNoTriangle;
    }
    waiting &= ~(traced | left_out);
    low = vec2(cluster_min(low.x), cluster_min(low.y));
    high = vec2(cluster_max(high.x), cluster_max(high.y));
    // A power of two, so that the packet measures 8 to 16 and scaling rounds nothing.
    float extent = greater(greater(high.x - low.x, high.y - low.y), 9.5367431640625e-07f);
    float scale = 8.0f * scale_to_unit(extent);
    [[unroll]] for (uint k = 0u; k < kVectors; ++k) {
        plane_x[k] *= scale;
        plane_y[k] *= scale;
    }
    vec3 unit_x = vec3(scale, 0.0f, -scale * shear.x);
    vec3 unit_y = vec3(0.0f, scale, -scale * shear.y);
    vec3 unit_z = vec3(0.0f, 0.0f, side);
    // rotate_axes thrice is nothing; twice undoes once.
    uint back = axis == 0u ? 1u : axis == 1u ? 0u : 2u;
    frame.org = light;
    frame.row_x = rotate_axes(unit_x, back);
    frame.row_y = rotate_axes(unit_y, back);
    frame.row_z = rotate_axes(unit_z, back);
    frame.own_row = lane == 0u ? frame.row_x : lane == 1u ? frame.row_y : frame.row_z;
    frame.own_row_error = vec3(0.0f);
    frame.row_size = vec3(scale + scale * abs(shear.x), scale + scale * abs(shear.y), 1.0f);
    // Of x and y: roundings of values up to 3, over z >= 1/2, and a division; 2^-19 and 2^-17.
    frame.ray_error = vec2(1.9073486328125e-06f * scale + 7.62939453125e-06f);
    frame.lower = scale * low - frame.ray_error;
    frame.upper = scale * high + frame.ray_error;
    frame.depth_error = box_dilation(light);
    // 2^-13: as in `primary_packet`, with distances up to 64.
    frame.rounding = 1.220703125e-04f;
}

uint trace_triangle(Setup s, uint name) {
    [[unroll]] for (uint v = 0u; v < kVectors; ++v) {
        float x = plane_x[v];
        float y = plane_y[v];
        vec3 e = s.a * x + s.b * y + s.c;
        float q = s.q.x * x + s.q.y * y + s.q.z;
        float inside = lesser(e.x, lesser(e.y, e.z));
        bool is_sure = inside > s.bound && q - s.q_error > q_upper[v];
        bool is_doubtful = inside >= -s.bound && q + s.q_error >= q_lower[v] && !is_sure;
        left_out |= is_doubtful && second_doubts[v] != kNoTriangle ? 1u << v : 0u;
        second_doubts[v] = is_doubtful ? doubts[v] : second_doubts[v];
        doubts[v] = is_doubtful ? name : doubts[v];
        q_lower[v] = is_sure ? kDone : q_lower[v];
        q_upper[v] = is_sure ? kDone : q_upper[v];
    }
    return 0u;
}

bool note_doubt(uint name, uint vectors) { return true; }

float least_q() {
    float least = q_lower[0];
    [[unroll]] for (uint v = 1u; v < kVectors; ++v) least = lesser(least, q_lower[v]);
    return cluster_min(least);
}

/// Settles the doubts: the one of each ray, mostly, by the rule's plain path, a vector at a time;
/// where that does not do and where there is another, by the whole rule, one of each lane at a
/// time.
void settle_doubts() {
    uint first = 0u;
    uint second = 0u;
    [[unroll]] for (uint v = 0u; v < kVectors; ++v) {
        bool is_done = q_lower[v] == kDone;
        uint bit = 1u << v;
        shadowed |= is_done ? traced & bit : 0u;
        first |= !is_done && doubts[v] != kNoTriangle ? bit : 0u;
        second |= !is_done && second_doubts[v] != kNoTriangle ? bit : 0u;
    }
    left_out &= ~shadowed;
    first &= traced & ~left_out;
    second &= traced & ~left_out;
    uint unsure = 0u;
    uint left = cluster_or(first);
    do {
        uint v = uint(findLSB(left)) & (kVectors - 1u);
        bool is_own = (first >> v & 1u) != 0u;
        Ray ray = ray_of(v);
        vec3 a, b, c;
        named_triangle(is_own ? doubt_of(v) : 0u, a, b, c);
        ShearedRay sheared = shear_ray(ray.org, ray.dir);
        vec3 pa = project_fast(sheared, a);
        vec3 pb = project_fast(sheared, b);
        vec3 pc = project_fast(sheared, c);
        Edges e = fast_edges(pa, pb, pc);
        TriangleHit hit;
        bool in_range = weighted_hit(sheared, ray.tnear, ray.tfar, e, pa.z, pb.z, pc.z, hit);
        bool is_sure = surely_inside(sheared, e);
        uint bit = is_own ? 1u << v : 0u;
        shadowed |= is_sure && in_range ? bit : 0u;
        unsure |= !is_sure && may_be_inside(e) ? bit : 0u;
        left &= left - 1u;
    } while (left != 0u);
    second &= ~shadowed;
    bool more = true;
    do {
        uint open = unsure | second;
        uint v = uint(findLSB(open)) & (kVectors - 1u);
        uint bit = open & (0u - open);
        bool is_first = (unsure & bit) != 0u;
        Ray ray = ray_of(v);
        vec3 a, b, c;
        named_triangle(open == 0u ? 0u : is_first ? doubt_of(v) : second_doubt_of(v), a, b, c);
        TriangleHit hit;
        bool is_hit =
            intersect_triangle(shear_ray(ray.org, ray.dir), ray.tnear, ray.tfar, a, b, c, hit);
        shadowed |= is_hit ? bit : 0u;
        unsure &= ~bit;
        second &= is_hit || !is_first ? ~bit : kAllBits;
        more = cluster_or(unsure | second) != 0u;
    } while (more);
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
        if ((left_out >> v & 1u) != 0u) suspend(ray_of(v), answer_index(ray_pixel(v)));
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
    do {
        uint seen = 0u;
        uint any = 0u;
        do {
            // Always so, but see cluster.glsl.
            if (any == 0u) {
                packet_origin = uvec2(packet % args.tile_columns, packet / args.tile_columns) *
                                uvec2(kPacketWidth, kPacketHeight);
                seen = find_seen();
                any = cluster_or(seen);
            }
            ++packet;
        } while (any == 0u && packet < end);
        make_rays(seen);
        uint round = 0u;
        do {
            ++round;
            set_frame(round == kMaxRounds);
            set_planes();
            begin_traversal();
            packet_q = least_q();
            Traversal t;
            t.current = cluster_or(traced) != 0u ? 0u : kEmptyChild;
            t.triangles = kAllTriangles;
            t.steps = 0u;
            traverse(t);
            if (t.current != kEmptyChild) left_out |= traced;
            settle_doubts();
        } while (cluster_or(waiting) != 0u && round < kMaxRounds);
        write_answers();
    } while (packet < end);
}
