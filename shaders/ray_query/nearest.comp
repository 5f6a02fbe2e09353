// Asks the driver for the closest hit of each ray of a batch.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/ray_query/rays.glsl"

layout(std430, binding = kBindHits) writeonly buffer Hits { Hit hits[]; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= args.ray_count) return;
    Ray ray = rays[i];
    rayQueryEXT query;
    rayQueryInitializeEXT(query, scene, gl_RayFlagsOpaqueEXT, 0xFFu, ray.org, ray.tnear, ray.dir,
                          ray.tfar);
    while (rayQueryProceedEXT(query)) {
    }
    Hit hit = no_hit();
    if (rayQueryGetIntersectionTypeEXT(query, true) ==
        gl_RayQueryCommittedIntersectionTriangleEXT) {
        vec2 weights = rayQueryGetIntersectionBarycentricsEXT(query, true);
        hit.t = rayQueryGetIntersectionTEXT(query, true);
        hit.u = weights.x;
        hit.v = weights.y;
        hit.prim_id =
            checked_prim(uint(rayQueryGetIntersectionPrimitiveIndexEXT(query, true)),
                         uint(rayQueryGetIntersectionGeometryIndexEXT(query, true)),
                         uint(rayQueryGetIntersectionInstanceIdEXT(query, true)));
    }
    hits[i] = hit;
}
