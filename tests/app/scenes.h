// Small scenes as OBJ text.
#pragma once

#include <fmt/format.h>

#include <string>

namespace mray::test {

/// The triangle (0,0,0) (1,0,0) (0,1,0), each coordinate times `scale`.
inline std::string unit_triangle(double scale = 1) {
    return fmt::format("v 0 0 0\nv {0:.9g} 0 0\nv 0 {0:.9g} 0\nf 1 2 3\n", scale);
}

/// A square of two triangles in the plane z = 0 around (x, 0, 0).
inline std::string square_at(double x) {
    return fmt::format("v {0} -1 0\nv {1} -1 0\nv {1} 1 0\nv {0} 1 0\nf 1 2 3\nf 1 3 4\n", x - 1,
                       x + 1);
}

/// The cube from -1 to 1, each coordinate times `scale`: closed, with normals that point outside.
inline std::string cube(double scale = 1) {
    std::string text;
    for (int i = 0; i < 8; ++i)
        text += fmt::format("v {} {} {}\n", (i & 1) != 0 ? scale : -scale,
                            (i & 2) != 0 ? scale : -scale, (i & 4) != 0 ? scale : -scale);
    return text + "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
}

/// Poses of a square of which one, with as many vertices and faces, is split along the other
/// diagonal.
inline std::string square_of_frame(int frame, int other_frame) {
    const std::string square = square_at(0.1 * frame);
    if (frame != other_frame) return square;
    return square.substr(0, square.find('f')) + "f 1 2 4\nf 2 3 4\n";
}

}  // namespace mray::test
