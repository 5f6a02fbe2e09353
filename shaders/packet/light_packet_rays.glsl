// The shadow rays of a light packet's pixels.
#ifndef SHADERS_PACKET_LIGHT_PACKET_RAYS_GLSL
#define SHADERS_PACKET_LIGHT_PACKET_RAYS_GLSL

#include "shaders/base/found_hits.glsl"
#include "shaders/packet/packet.glsl"
#include "shaders/packet/packet_pixels.glsl"
#include "shaders/shade/pixel_surface.glsl"

layout(push_constant) uniform Arguments { RegionArguments args; };

/// Directions and tfar.
float dir_x[kVectors];
float dir_y[kVectors];
float dir_z[kVectors];
float tfar[kVectors];

/// The triangles that the pixels show, before rays are made; t is in tfar.
uint visible_prims[kVectors];

// One bit for each vector of this lane's rays: rays that wait for a packet, rays of the packet,
// occluded rays, and rays that are left to `resume`.
uint waiting;
uint traced;
uint shadowed;
uint left_out;

Camera camera;
vec3 light;

/// Copies the arguments that all rays need (packet_pixels.glsl says why).
void read_arguments() {
    camera = args.params.camera;
    light = args.params.light;
    region_origin = uvec2(args.x, args.y);
    region_size = uvec2(args.width, args.height);
}

/// Returns the vectors of this lane whose pixel is visible. Sets visible_prims and tfar.
uint find_visible() {
    uint visible = 0u;
    [[unroll]] for (uint v = 0u; v < kVectors; ++v) {
        uvec2 pixel = ray_pixel(v);
        uint index = is_active(pixel) ? answer_index(pixel) : 0u;
        Hit hit = found_hit(index);
        bool is_visible = is_active(pixel) && hit.prim_id < kUnfinishedPrim;
        visible |= is_visible ? 1u << v : 0u;
        visible_prims[v] = is_visible ? hit.prim_id : 0u;
        tfar[v] = hit.t;
    }
    return visible;
}

// These functions access vector i of a row without an index such as dir_x[4 * row + i], which would
// make the array slow wherever it is used. So loops go over rows, with the vectors of a row
// unrolled.

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

Hit visible_hit(uint row, uint i) {
    Hit hit;
    hit.t = tfar[i];
    hit.u = 0.0f;
    hit.v = 0.0f;
    hit.prim_id = visible_prims[i];
    [[unroll]] for (uint r = 1u; r < kRows; ++r) {
        uint v = 4u * r + i;
        hit.t = row == r ? tfar[v] : hit.t;
        hit.prim_id = row == r ? visible_prims[v] : hit.prim_id;
    }
    return hit;
}

/// The ray of a vector that may differ between lanes.
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

void make_rays(uint visible) {
    waiting = 0u;
    shadowed = 0u;
    left_out = 0u;
    uint left = cluster_or(visible);
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
            hits[i] = visible_hit(row, i);
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
            bool is_visible = (visible >> v & 1u) != 0u;
            bool faces = faces_light(surfaces[i], light);
            waiting |= is_visible && faces ? 1u << v : 0u;
            shadowed |= is_visible && !faces ? 1u << v : 0u;
            set_ray(row, i, shadow_ray(surfaces[i], light));
        }
        left &= ~(kFirstRow << (4u * row));
    } while (left != 0u);
}

#endif  // SHADERS_PACKET_LIGHT_PACKET_RAYS_GLSL
