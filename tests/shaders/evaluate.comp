// Evaluates one case a lane.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/kernel.glsl"

#include "tests/shaders/evaluate.h"

layout(push_constant) uniform Arguments { uint case_count; };
layout(std430, binding = kBindHits) readonly buffer Cases { Inputs cases[]; };
layout(std430, binding = kBindOcclusion) writeonly buffer Answers { Outputs answers[]; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i < case_count) answers[i] = evaluate(cases[i]);
}
