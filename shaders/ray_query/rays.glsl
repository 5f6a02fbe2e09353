// Rays of a batch and the scene of the driver. These kernels declare no modes of floats, since no
// program that asks a driver for hits does, and they compute nothing themselves.
#ifndef SHADERS_RAY_QUERY_RAYS_GLSL
#define SHADERS_RAY_QUERY_RAYS_GLSL

#extension GL_EXT_ray_query : require
#include "shaders/kernel_interface.h"

layout(local_size_x = kGroupSize) in;

layout(push_constant) uniform Arguments { RayQueryArguments args; };
layout(binding = kBindStructure) uniform accelerationStructureEXT scene;
layout(std430, binding = kBindStoredRays) readonly buffer Rays { Ray rays[]; };

/// prim_id of a triangle, or kForeignPrim if it is of another mesh than the one there is.
uint checked_prim(uint prim_id, uint geometry, uint instance) {
    return geometry == 0u && instance == 0u ? prim_id : kForeignPrim;
}

#endif  // SHADERS_RAY_QUERY_RAYS_GLSL
