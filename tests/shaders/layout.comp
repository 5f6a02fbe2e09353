// Every struct that host and kernels share, in the layout of a storage buffer.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/kernel.glsl"

layout(std430, binding = kBindHits) readonly buffer Shared {
    Node node;
    Leaf leaf;
    RegionArguments region;
    LitArguments lit;
    OcclusionArguments occlusion;
    CountArguments count;
    ResumeArguments resume;
    RefitArguments refit;
    WorkHeader header;
    Suspended suspended;
    Hit hit;
};
layout(std430, binding = kBindPixels) writeonly buffer Result { uint result; };

void main() {
    result = node.child[0] + leaf.prim_id[0] + region.x + lit.x + occlusion.x + count.count + resume.first +
             refit.first + header.suspended_count + suspended.answer_index + hit.prim_id;
}
