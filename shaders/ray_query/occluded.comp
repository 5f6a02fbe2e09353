// Asks the driver whether each ray of a batch hits anything: 1 or 0.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/ray_query/rays.glsl"

layout(std430, binding = kBindOcclusion) writeonly buffer Occlusion { uint occluded[]; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= args.ray_count) return;
    Ray ray = rays[i];
    rayQueryEXT query;
    rayQueryInitializeEXT(query, scene, gl_RayFlagsOpaqueEXT | gl_RayFlagsTerminateOnFirstHitEXT,
                          0xFFu, ray.org, ray.tnear, ray.dir, ray.tfar);
    while (rayQueryProceedEXT(query)) {
    }
    bool is_hit = rayQueryGetIntersectionTypeEXT(query, true) !=
                  gl_RayQueryCommittedIntersectionNoneEXT;
    occluded[i] = is_hit ? 1u : 0u;
}
