// Writes the boxes of one level of nodes to the slots of their parents. Empty slots hold inverted
// boxes, which are neutral in a union.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/base/exact.glsl"

#include "shaders/refit/refit.glsl"

READ1(NodeParents, node_parents, kBindNodeParents);

void main() {
    uint node = refit_item();
    vec3 lower = vec3(kEmptyPlane);
    vec3 upper = vec3(-kEmptyPlane);
    if (is_within()) {
        float planes[6];
        for (uint p = 0u; p < 6u; ++p) planes[p] = load_plane(plane_at(node, p) + refit_lane());
        lower = vec3(planes[0], planes[2], planes[4]);
        upper = vec3(planes[1], planes[3], planes[5]);
    }
    unite(lower, upper);
    if (is_within()) store_box(AT1(node_parents, node), lower, upper);
}
