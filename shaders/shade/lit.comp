// Shades the pixels of a region of a lit image, or one in false colours, from its samples.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/kernel.glsl"
#include "shaders/shade/lit_samples.glsl"

READ4(Surfaces, surfaces, kBindRays);
READ1(FoundOcclusion, found_occlusion, kBindFoundOcclusion);
layout(std430, binding = kBindPixels) writeonly buffer Pixels { uint pixels[]; };
layout(std430, binding = kBindLinear) writeonly buffer Linear { float linear[]; };
layout(std430, binding = kBindWork) buffer Work { WorkHeader header; } work;

shared uint shown_in_group;

/// Of the sample that is shaded, which only lit images have.
precise vec3 linear_colour = vec3(0.0f);

uint index_of(uvec2 at) { return at.y * args.width + at.x; }

bool has_sky() { return args.kind == kLitLit && args.ao_count != 0u; }

/// The share of the sky that a sample sees, by itself and by those beside it in its plane.
float open_of(uvec2 at, ShownHit s) {
    if (!has_sky()) return 1.0f;
    SamplePlane plane = sample_plane(camera_of_image(), s.flat_normal, s.through, s.depth);
    uvec2 first = at - kAoSquareBefore;
    precise float occluded = 0.0f;
    precise float count = 0.0f;
    for (uint k = 0u; k < kAoSquareSide * kAoSquareSide; ++k) {
        uvec2 way = uvec2(k % kAoSquareSide, k / kAoSquareSide);
        uvec2 other = first + way;
        // Coordinates before the first sample wrap to large numbers.
        if (other.x >= args.width || other.y >= args.height) continue;
        uint index = index_of(other);
        vec4 surface = uintBitsToFloat(AT4(surfaces, index));
        precise float x = float(way.x) - float(kAoSquareBefore);
        precise float y = float(way.y) - float(kAoSquareBefore);
        if (!is_in_plane(plane, x, y, surface.xyz, surface.w)) continue;
        occluded += float(AT1(found_occlusion, index) & ((1u << kShadowShift) - 1u));
        count += 1.0f;
    }
    precise float rays = greater(count, 1.0f) * float(args.ao_count);
    return openness(occluded, rays);
}

ShownHit shown_hit(uint index, uvec2 place, Hit hit) {
    vec4 surface = uintBitsToFloat(AT4(surfaces, index));
    vec3 normal = surface.xyz;
    if ((args.flags & kLitSmooth) != 0u) {
        CornerNormals n = corner_normals(hit.prim_id, normal);
        normal = smooth_normal(n.a, n.b, n.c, hit.u, hit.v);
    }
    return ShownHit(normal, surface.xyz, camera_direction(camera_of_image(), place.x, place.y),
                    surface.w, hit.prim_id);
}

/// As on flat triangles without a sky.
uint plain_colour(ShownHit s, uint index, uvec2 place, float t) {
    Camera camera = camera_of_image();
    ImageParams params = ImageParams(camera, args.light, 0.0f, 0u, 0u, args.rays, args.ao_count);
    Ray ray = camera_ray(camera, place.x, place.y);
    return shade(params, ray, surface_with(ray.org, ray.dir, t, s.flat_normal),
                 AT4(triangles, s.prim).w, AT1(found_occlusion, index));
}

SampleColour lit_colour_of(ShownHit s, uvec2 at, float height, float dithered) {
    uint occlusion = AT1(found_occlusion, index_of(at));
    uint shadow = has_sky() ? occlusion >> kShadowShift : occlusion;
    precise float light = 1.0f - float(shadow);
    uint albedo = AT4(triangles, s.prim).w;
    return lit_sample(s, args.org, args.light, args.up, light, open_of(at, s), albedo,
                      albedo_colour(albedo), height, dithered);
}

/// The colour of sample `at` of the region; adds 1 to `shown` if it has a hit.
uint colour_of_sample(uvec2 at, inout uint shown) {
    uint index = index_of(at);
    uvec2 place = uvec2(args.x, args.y) + at;
    Hit hit = hit_from(AT4(found_hits, index));
    bool is_hit = hit.prim_id != kNoPrim;
    ShownHit s;
    if (is_hit) {
        shown += 1u;
        s = shown_hit(index, place, hit);
    }
    if (args.kind == kLitLit) {
        float height = image_height(place.y, args.image_height);
        float dithered = dithered_rounding(place.x >> args.side_bits, place.y >> args.side_bits);
        SampleColour colour = sky_sample(height, dithered);
        if (is_hit) colour = lit_colour_of(s, at, height, dithered);
        linear_colour = colour.linear;
        return encode_rgb(colour.linear, colour.rounding);
    }
    if (args.kind == kLitPlain)
        return is_hit ? plain_colour(s, index, place, hit.t) : background(place.y, args.image_height);
    return is_hit ? false_colour(args.kind, s, args.near, args.per_depth) : kNoColour;
}

/// Shades a pixel. Returns the number of its samples with a hit.
uint shade_pixel(uint pixel) {
    uvec2 first = uvec2(pixel % args.columns, pixel / args.columns) << args.side_bits;
    first += first_of_pixels();
    uint side = 1u << args.side_bits;
    float share = sample_share(side);
    uint shown = 0u;
    uint colour = 0u;
    uvec3 squares = uvec3(0u);
    precise vec3 sum = vec3(0.0f);
    for (uint k = 0u; k < side * side; ++k) {
        uvec2 way = uvec2(k & (side - 1u), k >> args.side_bits);
        colour = colour_of_sample(first + way, shown);
        uvec3 channels = (uvec3(colour) >> uvec3(0u, 8u, 16u)) & 0xFFu;
        squares += channels * channels;
        sum += linear_colour;
    }
    if (side > 1u) colour = mean_colour(squares.x, squares.y, squares.z, share);
    pixels[pixel] = colour;
    if ((args.flags & kLitLinear) == 0u) return shown;
    precise vec3 mean = vec3(sum.x * share, sum.y * share, sum.z * share);
    for (uint k = 0u; k < 3u; ++k) linear[3u * pixel + k] = mean[k];
    return shown;
}

void main() {
    if (gl_LocalInvocationID.x == 0u) shown_in_group = 0u;
    barrier();
    uint pixel = gl_GlobalInvocationID.x;
    if (pixel < args.columns * args.rows) atomicAdd(shown_in_group, shade_pixel(pixel));
    barrier();
    if (gl_LocalInvocationID.x == 0u) atomicAdd(work.header.shown_count, shown_in_group);
}
