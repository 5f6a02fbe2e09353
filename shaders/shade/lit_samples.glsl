// The samples of a region of a lit image, for the kernels that take LitArguments.
#include "common/interop/camera.h"
#include "common/interop/shading.h"
#include "common/interop/surface.h"
#include "shaders/corners.glsl"

layout(push_constant) uniform Arguments { LitArguments args; };
READ4(FoundHits, found_hits, kBindFoundHits);
READ3(Normals, normals, kBindNormals);
READ3(NormalIds, normal_ids, kBindNormalIds);

Camera camera_of_image() {
    return Camera(args.org, 0.0f, args.corner, 0.0f, args.du, 0.0f, args.dv, 0.0f);
}

/// Where a sample of the region is in the image.
uvec2 place_in_image(uint index) {
    return uvec2(args.x + index % args.width, args.y + index / args.width);
}

/// The first sample of the region's pixels.
uvec2 first_of_pixels() {
    return uvec2((args.flags & kLitLeft) != 0u ? 1u : 0u, (args.flags & kLitAbove) != 0u ? 1u : 0u);
}

struct CornerNormals {
    vec3 a, b, c;
    /// Whether all of them are that of the triangle.
    bool is_flat;
};

vec3 normal_at_corner(uint id, vec3 flat_normal) {
    if (id == kNoNormal) return flat_normal;
    return corner_normal(uintBitsToFloat(AT3(normals, id)), flat_normal);
}

CornerNormals corner_normals(uint prim, vec3 flat_normal) {
    uvec3 ids = AT3(normal_ids, prim);
    bool is_flat = ids.x == kNoNormal && ids.y == kNoNormal && ids.z == kNoNormal;
    return CornerNormals(normal_at_corner(ids.x, flat_normal), normal_at_corner(ids.y, flat_normal),
                         normal_at_corner(ids.z, flat_normal), is_flat);
}

Surface flat_surface(uvec2 place, Hit hit, Corners v) {
    return surface_at(camera_ray(camera_of_image(), place.x, place.y), hit, v.a, v.b, v.c);
}
