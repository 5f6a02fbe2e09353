// The values behind the @names@ of the .g files: read from the code, so that a proof is about the
// constants that the tracers are compiled with.
#ifndef PROOFS_CONSTANTS_H
#define PROOFS_CONSTANTS_H

#include <string_view>

#include "common/interop/constants.h"
#include "common/interop/hit_rule.h"
#include "common/interop/packet_bounds.h"
#include "common/interop/winding_rule.h"
#include "cpu/simd/rounding_bounds.h"
#include "lab/proofs/bounds.h"

namespace mray::proofs {

struct Constant {
    std::string_view name;
    double value;
};

using namespace cpu;

/// The part of the depth margin that surely_inside spends.
inline float depth_slack_of_margin() {
    const vec3 org(0, 0, 0);
    return shear_ray(org, vec3(0, 0, 1)).depth_slack / depth_margin(org);
}
inline const float kDepthSlackOfMargin = depth_slack_of_margin();

/// Those that the .g files name: cmake lists them as PROOFS_CONSTANT(kName).
// NOLINTNEXTLINE(cppcoreguidelines-macro-usage)
#define PROOFS_CONSTANT(name) Constant{#name, name},
inline const Constant kConstants[] = {
#include "lab/proofs/constants.inc"
};
#undef PROOFS_CONSTANT

}  // namespace mray::proofs

#endif  // PROOFS_CONSTANTS_H
