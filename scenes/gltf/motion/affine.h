// Affine maps in double, with operations that are the same on every machine.
#pragma once

#include <array>
#include <span>

#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

namespace mray::gltf {

/// Maps p to column[0] * p.x + column[1] * p.y + column[2] * p.z + column[3].
struct Affine {
    std::array<glm::dvec3, 4> column = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, 0}}};
};

/// Translation, rotation (a quaternion x, y, z, w of length 1) and scale, applied from the last to
/// the first.
struct Trs {
    glm::dvec3 translation = {0, 0, 0};
    glm::dvec4 rotation = {0, 0, 0, 1};
    glm::dvec3 scale = {1, 1, 1};
};

inline glm::dvec3 linear_part(const Affine& a, const glm::dvec3& p) {
    return a.column[0] * p.x + a.column[1] * p.y + a.column[2] * p.z;
}
inline glm::dvec3 transformed(const Affine& a, const glm::dvec3& p) {
    return linear_part(a, p) + a.column[3];
}

/// The map that applies `b`, then `a`.
inline Affine product(const Affine& a, const Affine& b) {
    return {{linear_part(a, b.column[0]), linear_part(a, b.column[1]), linear_part(a, b.column[2]),
             transformed(a, b.column[3])}};
}

Affine affine_of(const Trs& trs);

}  // namespace mray::gltf
