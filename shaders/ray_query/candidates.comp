// Lists the triangles that the driver offers as candidates for each ray of a batch: args.most places
// a ray, and how many there were. None is confirmed, so the driver offers all that the ray hits.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/ray_query/rays.glsl"

layout(std430, binding = kBindHits) writeonly buffer Hits { Hit hits[]; };
layout(std430, binding = kBindHitCounts) writeonly buffer Counts { uint counts[]; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= args.ray_count) return;
    Ray ray = rays[i];
    rayQueryEXT query;
    rayQueryInitializeEXT(query, scene, gl_RayFlagsNoOpaqueEXT, 0xFFu, ray.org, ray.tnear, ray.dir,
                          ray.tfar);
    uint count = 0u;
    while (rayQueryProceedEXT(query)) {
        if (count < args.most) {
            vec2 weights = rayQueryGetIntersectionBarycentricsEXT(query, false);
            Hit hit;
            hit.t = rayQueryGetIntersectionTEXT(query, false);
            hit.u = weights.x;
            hit.v = weights.y;
            hit.prim_id =
                checked_prim(uint(rayQueryGetIntersectionPrimitiveIndexEXT(query, false)),
                             uint(rayQueryGetIntersectionGeometryIndexEXT(query, false)),
                             uint(rayQueryGetIntersectionInstanceIdEXT(query, false)));
            hits[i * args.most + count] = hit;
        }
        ++count;
    }
    counts[i] = count;
}
