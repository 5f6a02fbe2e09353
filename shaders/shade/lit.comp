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

/// A sample with a hit.
struct Shown {
    /// In the region, and in the image.
    uvec2 at;
    uvec2 place;
    Hit hit;
    vec3 through;
    vec3 flat_normal;
    float depth;
};

/// Of the sample that is shaded, which only lit images have.
precise vec3 linear_colour = vec3(0.0f);

uint index_of(uvec2 at) { return at.y * args.width + at.x; }

bool has_sky() { return args.kind == kLitLit && args.ao_count != 0u; }

/// The share of the sky that a sample sees, by itself and by those beside it in its plane.
float open_of(Shown s) {
    if (!has_sky()) return 1.0f;
    SamplePlane plane = sample_plane(camera_of_image(), s.flat_normal, s.through, s.depth);
    uvec2 first = s.at - kAoSquareBefore;
    precise float occluded = 0.0f;
    precise float count = 0.0f;
    for (uint k = 0u; k < kAoSquareSide * kAoSquareSide; ++k) {
        uvec2 way = uvec2(k % kAoSquareSide, k / kAoSquareSide);
        uvec2 other = first + way;
        // Those before the first one are large numbers.
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

vec3 shading_normal(Shown s) {
    if ((args.flags & kLitSmooth) == 0u) return s.flat_normal;
    CornerNormals n = corner_normals(s.hit.prim_id, s.flat_normal);
    return smooth_normal(n.a, n.b, n.c, s.hit.u, s.hit.v);
}

uint lit_colour_of(Shown s, float height, float dithered) {
    uint occlusion = AT1(found_occlusion, index_of(s.at));
    uint shadow = has_sky() ? occlusion >> kShadowShift : occlusion;
    precise float light = 1.0f - float(shadow);
    float open = open_of(s);
    uint albedo = AT4(triangles, s.hit.prim_id).w;
    if ((albedo & kShadowCatcherBit) != 0u) {
        linear_colour = shadow_catcher_colour(height, light, open);
        return encode_rgb(linear_colour, dithered);
    }
    precise vec3 to_light = args.light - point_at_depth(args.org, s.through, s.depth);
    linear_colour = lit_colour(shading_normal(s), unit(to_light), light, open, args.up,
                               albedo_colour(albedo));
    return encode_rgb(linear_colour);
}

/// As on flat triangles without a sky.
uint plain_colour(Shown s) {
    Camera camera = camera_of_image();
    ImageParams params = ImageParams(camera, args.light, 0.0f, 0u, 0u, args.rays, args.ao_count);
    Ray ray = camera_ray(camera, s.place.x, s.place.y);
    return shade(params, ray, surface_with(ray.org, ray.dir, s.hit.t, s.flat_normal),
                 AT4(triangles, s.hit.prim_id).w, AT1(found_occlusion, index_of(s.at)));
}

uint colour_of_kind(Shown s) {
    if (args.kind == kLitPlain) return plain_colour(s);
    if (args.kind == kLitDepth) return depth_colour(s.depth, args.near, args.per_depth);
    if (args.kind == kLitPrim)
        return prim_colour(s.hit.prim_id, dot3(s.flat_normal, unit(s.through)));
    return normal_colour(shading_normal(s));
}

uint colour_behind(uvec2 place, float height, float dithered) {
    if (args.kind == kLitPlain) return background(place.y, args.image_height);
    if (args.kind != kLitLit) return pack_rgb(0u, 0u, 0u);
    linear_colour = sky_colour(height);
    return encode_rgb(linear_colour, dithered);
}

/// The colour of sample `at` of the region; adds 1 to `shown` if it has a hit.
uint colour_of_sample(uvec2 at, inout uint shown) {
    uint index = index_of(at);
    uvec2 place = uvec2(args.x, args.y) + at;
    Hit hit = hit_from(AT4(found_hits, index));
    float height = image_height(place.y, args.image_height);
    float dithered = dithered_rounding(place.x >> args.side_bits, place.y >> args.side_bits);
    if (hit.prim_id == kNoPrim) return colour_behind(place, height, dithered);
    shown += 1u;
    vec4 surface = uintBitsToFloat(AT4(surfaces, index));
    Shown s = Shown(at, place, hit, camera_direction(camera_of_image(), place.x, place.y),
                    surface.xyz, surface.w);
    return args.kind == kLitLit ? lit_colour_of(s, height, dithered) : colour_of_kind(s);
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
