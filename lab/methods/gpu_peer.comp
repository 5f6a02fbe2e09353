// The tree that wins on GPUs: two boxes a node, few triangles a leaf, one ray a lane, plain floats
// (T. Aila, S. Laine. Understanding the Efficiency of Ray Traversal on GPUs. HPG 2009). Rays stay in
// registers, but for kPeerRays.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "lab/methods/gpu_peer_interface.h"
#include "common/interop/camera.h"
#include "common/interop/surface.h"
#include "shaders/kernel_interface.h"

layout(local_size_x = kGroupSize) in;
layout(constant_id = 0) const uint kMode = kPeerCamera;
layout(push_constant) uniform Arguments { PeerArguments args; };
layout(std430, binding = kBindNodes) readonly buffer Nodes { vec4 nodes[]; };
layout(std430, binding = kBindLeaves) readonly buffer Triangles { vec4 triangles[]; };
layout(std430, binding = kBindRays) readonly buffer Rays { Ray rays[]; };
layout(std430, binding = kBindHits) buffer Hits { Hit hits[]; };
layout(std430, binding = kBindOcclusion) buffer Occlusion { uint occluded[]; };

const int kEnd = 0x7FFFFFFF;

vec3 vertex(int triangle, int i) { return triangles[int(kPeerTriangleVec4s) * triangle + i].xyz; }

/// T. Möller, B. Trumbore. Fast, Minimum Storage Ray/Triangle Intersection. JGT 2(1), 1997.
bool intersect(Ray ray, int triangle, inout Hit best) {
    vec3 a = vertex(triangle, 0);
    vec3 ab = vertex(triangle, 1) - a;
    vec3 ac = vertex(triangle, 2) - a;
    vec3 p = cross(ray.dir, ac);
    float inv_det = 1.0f / dot(ab, p);
    vec3 from_a = ray.org - a;
    float u = dot(from_a, p) * inv_det;
    vec3 q = cross(from_a, ab);
    float v = dot(ray.dir, q) * inv_det;
    float t = dot(ac, q) * inv_det;
    if (!(u >= 0.0f && v >= 0.0f && u + v <= 1.0f && t > ray.tnear && t < best.t)) return false;
    best.t = t;
    best.u = u;
    best.v = v;
    best.prim_id = uint(triangle);
    return true;
}

/// The closest hit, whose prim_id is the index of a triangle of the tree; or any.
Hit trace(Ray ray, bool any_hit) {
    vec3 inv_dir = 1.0f / mix(ray.dir, vec3(1e-30f), equal(ray.dir, vec3(0.0f)));
    vec3 org_inv = ray.org * inv_dir;
    Hit best = no_hit();
    best.t = ray.tfar;
    int stack[kPeerMaxStack];
    int size = 0;
    int node = 0;
    while (node != kEnd) {
        while (node >= 0 && node != kEnd) {
            int at = node * int(kPeerNodeVec4s);
            vec4 xy0 = nodes[at];
            vec4 xy1 = nodes[at + 1];
            vec4 z = nodes[at + 2];
            ivec2 child = floatBitsToInt(nodes[at + 3].xy);
            vec4 tx = vec4(xy0.xy, xy1.xy) * inv_dir.x - org_inv.x;
            vec4 ty = vec4(xy0.zw, xy1.zw) * inv_dir.y - org_inv.y;
            vec4 tz = z * inv_dir.z - org_inv.z;
            vec2 near = max(max(min(tx.xz, tx.yw), min(ty.xz, ty.yw)),
                            max(min(tz.xz, tz.yw), vec2(ray.tnear)));
            vec2 far = min(min(max(tx.xz, tx.yw), max(ty.xz, ty.yw)),
                           min(max(tz.xz, tz.yw), vec2(best.t)));
            bvec2 is_hit = lessThanEqual(near, far);
            if (is_hit.x && is_hit.y) {
                bool is_swapped = near.y < near.x;
                node = is_swapped ? child.y : child.x;
                stack[size++] = is_swapped ? child.x : child.y;
            } else if (is_hit.x || is_hit.y) {
                node = is_hit.x ? child.x : child.y;
            } else {
                node = size > 0 ? stack[--size] : kEnd;
            }
        }
        if (node == kEnd) break;
        int leaf = ~node;
        bool is_done = false;
        for (int i = leaf >> 3; i < (leaf >> 3) + (leaf & 7); ++i)
            is_done = intersect(ray, i, best) && any_hit || is_done;
        node = size > 0 && !is_done ? stack[--size] : kEnd;
    }
    return best;
}

void main() {
    uint lane = gl_LocalInvocationID.x;
    if (kMode == kPeerRays) {
        uint i = gl_GlobalInvocationID.x;
        if (i < args.ray_count) hits[i] = trace(rays[i], false);
        return;
    }
    uvec2 tile = uvec2(gl_WorkGroupID.x % args.tile_columns, gl_WorkGroupID.x / args.tile_columns);
    uvec2 pixel = tile * kTileSize + uvec2((lane & 1u) | (lane >> 1u & 2u) | (lane >> 2u & 4u),
                                           (lane >> 1u & 1u) | (lane >> 2u & 2u) | (lane >> 3u & 4u));
    if (pixel.x >= args.params.width || pixel.y >= args.params.height) return;
    uint index = pixel.y * args.params.width + pixel.x;
    Ray ray = camera_ray(args.params.camera, pixel.x, pixel.y);
    if (kMode == kPeerCamera) {
        hits[index] = trace(ray, false);
        return;
    }
    Hit hit = hits[index];
    if (hit.prim_id == kNoPrim) return;
    int triangle = int(hit.prim_id);
    Surface s = surface_at(ray, hit, vertex(triangle, 0), vertex(triangle, 1), vertex(triangle, 2));
    ray = shadow_ray(s, args.params.light);
    bool is_lit = faces_light(s, args.params.light) && trace(ray, true).prim_id == kNoPrim;
    occluded[index] = is_lit ? 0u : 1u;
}
