// Prints the values behind the @names@ of the .g files: proofs are about the code's constants.
#include <cstdio>

#include "common/bvh/exact_closest.h"
#include "common/interop/constants.h"
#include "common/interop/hit_rule.h"
#include "common/interop/packet_bounds.h"
#include "common/interop/winding_rule.h"
#include "common/scene/triangle_crossing.h"
#include "cpu/simd/rounding_bounds.h"
#include "lab/proofs/bounds.h"

int main() {
    using namespace mray;
    using namespace mray::cpu;
    using namespace mray::proofs;
    // The part of the depth margin that surely_inside spends.
    const vec3 org(0, 0, 0);
    const float kDepthSlackOfMargin = shear_ray(org, vec3(0, 0, 1)).depth_slack / depth_margin(org);
    // Prints what the .g files name: cmake lists it as PROOFS_CONSTANT(kName).
    // NOLINTNEXTLINE(cppcoreguidelines-macro-usage)
#define PROOFS_CONSTANT(name) std::printf("%s %a\n", #name, static_cast<double>(name));
#include "lab/proofs/constants.inc"
}
