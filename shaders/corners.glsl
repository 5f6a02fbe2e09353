// The triangles of the scene with their corners.
READ4(Triangles, triangles, kBindTriangles);
READ3(Positions, positions, kBindPositions);

struct Corners {
    vec3 a, b, c;
};

Corners corners_of(uint prim) {
    uvec4 triangle = AT4(triangles, prim);
    return Corners(uintBitsToFloat(AT3(positions, triangle.x)),
                   uintBitsToFloat(AT3(positions, triangle.y)),
                   uintBitsToFloat(AT3(positions, triangle.z)));
}
