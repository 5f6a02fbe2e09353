// Makes the rays of samples that may be in shadow only because triangles are flat: from the light to the
// smooth surface above; then, of samples that see the light there, from there to the triangle. `resume`
// traces them, from the root of the tree.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/kernel.glsl"
#include "shaders/shade/lit_samples.glsl"

layout(std430, binding = kBindOcclusion) buffer Occlusion { uint occlusion[]; };
layout(std430, binding = kBindWork) buffer Work {
    WorkHeader header;
    Suspended suspended[];
} work;

// What the count of a sample is while its first ray is traced.
const uint kIsAsked = 2u;

void main() {
    uint index = gl_GlobalInvocationID.x;
    if (index >= args.width * args.height) return;
    uvec2 from_first = uvec2(index % args.width, index / args.width) - first_of_pixels();
    uvec2 from_pixel = from_first >> args.side_bits;
    if (from_pixel.x >= args.columns || from_pixel.y >= args.rows) return;
    bool is_second = (args.flags & kLitBetween) != 0u;
    uint count = occlusion[index];
    if (is_second && count > kIsAsked) occlusion[index] = 1u;
    if (count != (is_second ? kIsAsked : 1u)) return;
    Hit hit = hit_from(AT4(found_hits, index));
    if (hit.prim_id == kNoPrim) return;
    Corners v = corners_of(hit.prim_id);
    Surface s = flat_surface(place_in_image(index), hit, v);
    CornerNormals n = corner_normals(hit.prim_id, s.normal);
    Surface above = smooth_surface(s, v.a, v.b, v.c, n.a, n.b, n.c, hit.u, hit.v);
    if (!is_second && (n.is_flat || !may_see_light(s, above, args.light))) return;
    occlusion[index] = is_second ? 0u : kIsAsked;
    Ray ray = shadow_ray(above, args.light);
    if (is_second) ray = ray_between(s, above);
    uint i = atomicAdd(work.header.suspended_count, 1u);
    work.suspended[i].ray = ray;
    work.suspended[i].answer_index = index;
}
