// The shadow rays of a packet's pixels, from the light.
#ifndef SHADERS_PACKET_LIGHT_PACKET_RAYS_GLSL
#define SHADERS_PACKET_LIGHT_PACKET_RAYS_GLSL

#include "shaders/single_ray/found_hits.glsl"
#include "shaders/packet/packet.glsl"
#include "shaders/shade/pixel_surface.glsl"

layout(push_constant) uniform Arguments { RegionArguments args; };

/// Directions and tfar.
float dir_x[kVectors];
float dir_y[kVectors];
float dir_z[kVectors];
float tfar[kVectors];

/// What the pixels show, before there are rays; t is in tfar.
uint seen_prims[kVectors];

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

/// Which vectors show something, on this lane. Leaves seen_prims and t.
uint find_seen() {
    uint seen = 0u;
    [[unroll]] for (uint v = 0u; v < kVectors; ++v) {
        uvec2 pixel = ray_pixel(v);
        uint index = is_active(pixel) ? answer_index(pixel) : 0u;
        Hit hit = found_hit(index);
        bool is_seen = is_active(pixel) && hit.prim_id < kUnfinishedPrim;
        seen |= is_seen ? 1u << v : 0u;
        seen_prims[v] = is_seen ? hit.prim_id : 0u;
        tfar[v] = hit.t;
    }
    return seen;
}

// Of vector i of a row. Not dir_x[4 * row + i] and so on: arrays that are indexed so are slow
// wherever they are used. Hence loops over rows, with the vectors of a row one after the other.

void set_ray(uint row, uint i, Ray ray) {
    [[unroll]] for (uint r = 0u; r < kRows; ++r) {
        uint v = 4u * r + i;
        dir_x[v] = row == r ? ray.dir.x : dir_x[v];
        dir_y[v] = row == r ? ray.dir.y : dir_y[v];
        dir_z[v] = row == r ? ray.dir.z : dir_z[v];
        tfar[v] = row == r ? ray.tfar : tfar[v];
    }
}

Ray ray_of(uint row, uint i) {
    Ray ray;
    ray.org = light;
    ray.tnear = 0.0f;
    ray.dir = vec3(dir_x[i], dir_y[i], dir_z[i]);
    ray.tfar = tfar[i];
    [[unroll]] for (uint r = 1u; r < kRows; ++r) {
        uint v = 4u * r + i;
        ray.dir.x = row == r ? dir_x[v] : ray.dir.x;
        ray.dir.y = row == r ? dir_y[v] : ray.dir.y;
        ray.dir.z = row == r ? dir_z[v] : ray.dir.z;
        ray.tfar = row == r ? tfar[v] : ray.tfar;
    }
    return ray;
}

Hit seen_hit(uint row, uint i) {
    Hit hit;
    hit.t = tfar[i];
    hit.u = 0.0f;
    hit.v = 0.0f;
    hit.prim_id = seen_prims[i];
    [[unroll]] for (uint r = 1u; r < kRows; ++r) {
        uint v = 4u * r + i;
        hit.t = row == r ? tfar[v] : hit.t;
        hit.prim_id = row == r ? seen_prims[v] : hit.prim_id;
    }
    return hit;
}

/// Of a vector that may differ from lane to lane.
Ray any_ray_of(uint v) {
    Ray ray = ray_of(v >> 2u, 0u);
    [[unroll]] for (uint i = 1u; i < 4u; ++i) {
        Ray other = ray_of(v >> 2u, i);
        bool is_other = (v & 3u) == i;
        ray.dir.x = is_other ? other.dir.x : ray.dir.x;
        ray.dir.y = is_other ? other.dir.y : ray.dir.y;
        ray.dir.z = is_other ? other.dir.z : ray.dir.z;
        ray.tfar = is_other ? other.tfar : ray.tfar;
    }
    return ray;
}

void make_rays(uint seen) {
    waiting = 0u;
    shadowed = 0u;
    left_out = 0u;
    uint left = cluster_or(seen);
    do {
        uint row = (uint(findLSB(left)) & (kVectors - 1u)) >> 2u;
        Hit hits[4];
        uvec4 triangle[4];
        vec3 a[4];
        vec3 b[4];
        vec3 c[4];
        Ray eyes[4];
        Surface surfaces[4];
        [[unroll]] for (uint i = 0u; i < 4u; ++i) {
            hits[i] = seen_hit(row, i);
            triangle[i] = scene_triangle(hits[i].prim_id);
        }
        [[unroll]] for (uint i = 0u; i < 4u; ++i) {
            a[i] = scene_vertex(triangle[i].x);
            b[i] = scene_vertex(triangle[i].y);
            c[i] = scene_vertex(triangle[i].z);
        }
        [[unroll]] for (uint i = 0u; i < 4u; ++i) {
            uvec2 pixel = region_origin + ray_pixel(4u * row + i);
            eyes[i] = camera_ray(camera, pixel.x, pixel.y);
        }
        [[unroll]] for (uint i = 0u; i < 4u; ++i) {
            surfaces[i] = surface_at(eyes[i], hits[i], a[i], b[i], c[i]);
        }
        [[unroll]] for (uint i = 0u; i < 4u; ++i) {
            uint v = 4u * row + i;
            bool is_seen = (seen >> v & 1u) != 0u;
            bool faces = faces_light(surfaces[i], light);
            waiting |= is_seen && faces ? 1u << v : 0u;
            shadowed |= is_seen && !faces ? 1u << v : 0u;
            set_ray(row, i, shadow_ray(surfaces[i], light));
        }
        left &= ~(kFirstRow << (4u * row));
    } while (left != 0u);
}

#endif  // SHADERS_PACKET_LIGHT_PACKET_RAYS_GLSL
