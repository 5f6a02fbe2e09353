// Answers one case a lane; specialisation constant 0 picks the function.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/kernel.glsl"

#include "tests/shaders/evaluate.h"

layout(local_size_x = kGroupSize) in;
layout(constant_id = 0) const uint kFunction = 0u;

layout(push_constant) uniform Arguments { uint case_count; };
layout(std430, binding = kBindHits) readonly buffer Cases { Inputs cases[]; };
layout(std430, binding = kBindOcclusion) writeonly buffer Answers { Outputs answers[]; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= case_count) return;
    answers[i] = evaluate(kFunction, cases[i]);
}
