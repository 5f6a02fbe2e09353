#include "scenes/gltf/motion/affine.h"

namespace mray::gltf {

Affine affine_of(const Trs& trs) {
    const double x = trs.rotation.x;
    const double y = trs.rotation.y;
    const double z = trs.rotation.z;
    const double w = trs.rotation.w;
    Affine a;
    a.column[0] =
        glm::dvec3(1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)) * trs.scale.x;
    a.column[1] =
        glm::dvec3(2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)) * trs.scale.y;
    a.column[2] =
        glm::dvec3(2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)) * trs.scale.z;
    a.column[3] = trs.translation;
    return a;
}

}  // namespace mray::gltf
