// All kernels of the backend.
#pragma once

#include "gpu/vulkan/pipeline.h"

namespace mray::gpu {

/// Workgroups for so many lanes.
inline std::uint32_t groups_of(std::uint32_t lanes) {
    return (lanes + kGroupSize - 1) / kGroupSize;
}

struct Kernels {
    Kernels(Context& context, const Tuning& tuning);

    void bind(const Bindings& bindings);

    /// Lanes of a packet; 0 if the device has no packet kernels.
    std::uint32_t packet_lanes;
    Pipeline primary;
    Pipeline camera_packet;
    Pipeline light_packet;
    /// light_packet for packets of twice the height; needs 8 lanes.
    Pipeline tall_light_packet;
    Pipeline rays;
    Pipeline compact;
    Pipeline occlusion;
    Pipeline occlusion_packet;
    Pipeline resume;
    Pipeline shade;
    Pipeline refit_leaves;
    Pipeline refit_nodes;
};

/// Dispatches each kernel once, over nothing. Some drivers, such as lavapipe, compile a kernel at
/// its first dispatch.
void warm_up(Context& context, const Kernels& kernels);

}  // namespace mray::gpu
