// All kernels of the backend.
#pragma once

#include "gpu/vulkan/pipeline.h"

namespace morphray::gpu {

struct Kernels {
    Kernels(Context& context, const Tuning& tuning);

    /// No work may be under way. `deform` is left alone where there are no keyframes.
    void bind(const Bindings& bindings);

    /// Lanes of a packet; 0: there are no packet kernels.
    std::uint32_t packet_lanes;
    Pipeline primary;
    Pipeline primary_packet;
    Pipeline shadow_packet;
    /// Of packets twice as high; needs 8 lanes.
    Pipeline tall_shadow_packet;
    Pipeline rays;
    Pipeline select;
    Pipeline occlusion;
    Pipeline occlusion_packet;
    Pipeline resume;
    Pipeline shade;
    Pipeline deform;
    Pipeline refit_leaves;
    Pipeline refit_nodes;
};

}  // namespace morphray::gpu
