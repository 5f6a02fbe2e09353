// Small scenes as OBJ text, which may be joined.
#pragma once

#include <fmt/format.h>

#include <string>

namespace mray::test {

/// The triangle (0,0,0) (1,0,0) (0,1,0), each coordinate times `scale`.
inline std::string unit_triangle(double scale = 1) {
    return fmt::format("v 0 0 0\nv {0:.9g} 0 0\nv 0 {0:.9g} 0\nf 1 2 3\n", scale);
}

/// A square of two triangles around (x, 0, z), at right angles to z.
inline std::string square_at(double x, double z = 0) {
    return fmt::format(
        "v {0} -1 {2}\nv {1} -1 {2}\nv {1} 1 {2}\nv {0} 1 {2}\nf -4 -3 -2\nf -4 -2 -1\n", x - 1,
        x + 1, z);
}

/// A cube with this lower corner: closed, with normals that point outside.
inline std::string box(double x, double y, double z, double side) {
    std::string text;
    for (int i = 0; i < 8; ++i)
        text += fmt::format("v {} {} {}\n", x + side * (i & 1), y + side * (i >> 1 & 1),
                            z + side * (i >> 2));
    return text +
           "f -8 -6 -5 -7\nf -4 -3 -1 -2\nf -8 -7 -3 -4\nf -6 -2 -1 -5\nf -8 -4 -2 -6\nf -7 -5 -1 "
           "-3\n";
}
/// The cube from -1 to 1, each coordinate times `scale`.
inline std::string cube(double scale = 1) { return box(-scale, -scale, -scale, 2 * scale); }

}  // namespace mray::test
