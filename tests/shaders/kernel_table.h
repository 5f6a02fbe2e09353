// The compiled kernels of the backend.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "shaders/kernel_interface.h"
#include "shaders/occlusion/occlusion_packet_spirv.h"
#include "shaders/occlusion/occlusion_spirv.h"
#include "shaders/packet/camera_packet_8_spirv.h"
#include "shaders/packet/camera_packet_spirv.h"
#include "shaders/packet/light_packet_8_spirv.h"
#include "shaders/packet/light_packet_spirv.h"
#include "shaders/packet/tall_light_packet_8_spirv.h"
#include "shaders/queries/closest_spirv.h"
#include "shaders/queries/hits_spirv.h"
#include "shaders/queries/winding_spirv.h"
#include "shaders/refit/refit_leaves_spirv.h"
#include "shaders/refit/refit_nodes_spirv.h"
#include "shaders/shade/compact_spirv.h"
#include "shaders/shade/shade_spirv.h"
#include "shaders/single_ray/primary_spirv.h"
#include "shaders/single_ray/rays_spirv.h"
#include "shaders/single_ray/resume_spirv.h"

namespace mray::test {

struct Kernel {
    const char* name;
    std::span<const std::uint32_t> words;
    /// The size of its push constants.
    std::size_t argument_bytes;
    /// Whether it has arithmetic outside the hit rule, whose bounds hold in any order and with any
    /// fusion.
    bool has_bounds = false;
};

inline const Kernel kKernels[] = {
    {"camera_packet", k_camera_packet_spirv, sizeof(PacketArguments), true},
    {"camera_packet_8", k_camera_packet_8_spirv, sizeof(PacketArguments), true},
    {"closest", k_closest_spirv, sizeof(QuestionArguments)},
    {"compact", k_compact_spirv, sizeof(RegionArguments)},
    {"hits", k_hits_spirv, sizeof(QuestionArguments)},
    {"light_packet", k_light_packet_spirv, sizeof(RegionArguments), true},
    {"light_packet_8", k_light_packet_8_spirv, sizeof(RegionArguments), true},
    {"occlusion", k_occlusion_spirv, sizeof(OcclusionArguments)},
    {"occlusion_packet", k_occlusion_packet_spirv, sizeof(OcclusionArguments), true},
    {"primary", k_primary_spirv, sizeof(RegionArguments)},
    {"rays", k_rays_spirv, sizeof(RaysArguments)},
    {"refit_leaves", k_refit_leaves_spirv, sizeof(RefitArguments)},
    {"refit_nodes", k_refit_nodes_spirv, sizeof(RefitArguments)},
    {"resume", k_resume_spirv, sizeof(ResumeArguments)},
    {"shade", k_shade_spirv, sizeof(RegionArguments)},
    {"tall_light_packet_8", k_tall_light_packet_8_spirv, sizeof(RegionArguments), true},
    {"winding", k_winding_spirv, sizeof(QuestionArguments)},
};

}  // namespace mray::test
