// The nodes and leaves of the tree (common/interop/bvh_layout.h).
READ4_IN_PLACE(Nodes, nodes, kBindNodes);
READ4_IN_PLACE(Leaves, leaves, kBindLeaves);

// `leaf_at` is the index of a leaf times kLeafVec4s.

vec3 leaf_vertex(uint leaf_at, uint slot) {
    return uintBitsToFloat(AT4_IN_PLACE(leaves, leaf_at + slot).xyz);
}

void leaf_triangle(uint leaf_at, uint i, out vec3 a, out vec3 b, out vec3 c) {
    uint indices = AT4_IN_PLACE(leaves, leaf_at + i).w;
    a = leaf_vertex(leaf_at, corner(indices, 0u));
    b = leaf_vertex(leaf_at, corner(indices, 1u));
    c = leaf_vertex(leaf_at, corner(indices, 2u));
}

uint leaf_prim(uint leaf_at, uint i) {
    return AT4_IN_PLACE(leaves, leaf_at + kLeafPrimIds + i / 4u)[i % 4u];
}
