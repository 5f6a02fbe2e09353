#include "tests/fuzz/targets/targets.h"

#include <array>

namespace mray::fuzz {

std::span<const Target> targets() {
    static constexpr std::array kTargets = {
        Target{"obj", obj_failure},   Target{"mtl", mtl_failure}, Target{"ply", ply_failure},
        Target{"gltf", gltf_failure}, Target{"pc2", pc2_failure}, Target{"png", png_failure},
        Target{"jpeg", jpeg_failure},
    };
    return kTargets;
}

}  // namespace mray::fuzz
