// Shades the pixels of a region from hits and occlusion.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/kernel.glsl"
#include "common/interop/camera.h"
#include "common/interop/shading.h"
#include "common/interop/surface.h"

layout(push_constant) uniform Arguments { RegionArguments args; };
READ3(Positions, positions, kBindPositions);
READ4(Triangles, triangles, kBindTriangles);
READ4(FoundHits, found_hits, kBindFoundHits);
READ1(FoundOcclusion, found_occlusion, kBindFoundOcclusion);
layout(std430, binding = kBindPixels) writeonly buffer Pixels { uint pixels[]; };

/// Shades four pixels a lane, in stages: a single pixel is one long chain of dependent
/// instructions, and some devices look only a few hundred instructions ahead.
void main() {
    // Read here, since some devices read arguments lane by lane in divergent control flow.
    ImageParams params = args.params;
    uvec2 origin = uvec2(args.x, args.y);
    uvec2 size = uvec2(args.width, args.height);
    uint first_answer = args.first;
    // The four pixels of 8 lanes lie in a row of 32. Tiles keep their order, since the work is the
    // same everywhere and each thread of a CPU then reads memory in sequence.
    uint tile = gl_WorkGroupID.x;
    uint lane = gl_LocalInvocationID.x;
    uint begin = (lane & ~7u) * 4u;
    uvec2 tile_size = uvec2(1u << args.tile_bits, kShadedTilePixels >> args.tile_bits);
    uvec2 first = uvec2(tile % args.tile_columns, tile / args.tile_columns) * tile_size +
                  uvec2((begin & (tile_size.x - 1u)) + (lane & 7u), begin >> args.tile_bits);
    uint index[4], occluded[4], colours[4];
    uvec2 at[4];
    bool is_within[4], is_hit[4];
    Hit hits[4];
    uvec4 triangle[4];
    vec3 a[4], b[4], c[4];
    Ray rays[4];
    Surface surfaces[4];
    [[unroll]] for (uint i = 0u; i < 4u; ++i) {
        uvec2 pixel = first + uvec2(8u * i, 0u);
        is_within[i] = pixel.x < size.x && pixel.y < size.y;
        index[i] = is_within[i] ? first_answer + pixel.y * size.x + pixel.x : 0u;
        at[i] = origin + pixel;
        hits[i] = hit_from(AT4(found_hits, index[i]));
        is_hit[i] = is_within[i] && hits[i].prim_id != kNoPrim;
    }
    [[unroll]] for (uint i = 0u; i < 4u; ++i) {
        triangle[i] = AT4(triangles, is_hit[i] ? hits[i].prim_id : 0u);
        // Without secondary rays it reads the same word for all, which stays in the cache.
        uint from = params.rays == kRaysPrimary ? 0u : index[i];
        occluded[i] = AT1(found_occlusion, from);
    }
    [[unroll]] for (uint i = 0u; i < 4u; ++i) {
        a[i] = uintBitsToFloat(AT3(positions, triangle[i].x));
        b[i] = uintBitsToFloat(AT3(positions, triangle[i].y));
        c[i] = uintBitsToFloat(AT3(positions, triangle[i].z));
    }
    [[unroll]] for (uint i = 0u; i < 4u; ++i) rays[i] = camera_ray(params.camera, at[i].x, at[i].y);
    [[unroll]] for (uint i = 0u; i < 4u; ++i)
        surfaces[i] = surface_at(rays[i], hits[i], a[i], b[i], c[i]);
    [[unroll]] for (uint i = 0u; i < 4u; ++i) {
        uint count = params.rays == kRaysPrimary ? 0u : occluded[i];
        uint colour = shade(params, rays[i], surfaces[i], triangle[i].w, count);
        colours[i] = is_hit[i] ? colour : background(at[i].y, params.height);
    }
    [[unroll]] for (uint i = 0u; i < 4u; ++i) {
        if (is_within[i]) pixels[index[i]] = colours[i];
    }
}
