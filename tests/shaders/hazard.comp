// Copies one word through separate read-only and write-only bindings.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/kernel.glsl"

layout(push_constant) uniform Arguments { uint unused; };
layout(std430, binding = kBindHits) readonly buffer From { uint from; };
layout(std430, binding = kBindOcclusion) writeonly buffer To { uint to; };

void main() {
    if (gl_GlobalInvocationID.x == 0u) to = from + unused;
}
