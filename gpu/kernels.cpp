#include "gpu/kernels.h"

#include <algorithm>
#include <cstdint>
#include <span>

#include "gpu/packet_arguments.h"

// Generated from shaders/*.comp; they use std::uint32_t without including it.
#include "shaders/occlusion/occlusion_packet_spirv.h"
#include "shaders/occlusion/occlusion_spirv.h"
#include "shaders/packet/camera_packet_spirv.h"
#include "shaders/packet/light_packet_spirv.h"
#include "shaders/refit/refit_leaves_spirv.h"
#include "shaders/refit/refit_nodes_spirv.h"
#include "shaders/shade/compact_spirv.h"
#include "shaders/shade/shade_spirv.h"
#include "shaders/single_ray/primary_spirv.h"
#include "shaders/single_ray/rays_spirv.h"
#include "shaders/single_ray/resume_spirv.h"

namespace mray::gpu {
namespace {

using Words = std::span<const std::uint32_t>;

Pipeline single_rays(Context& context, const char* name, Words spirv, const Tuning& tuning) {
    const std::uint32_t constants[] = {tuning.step_budget};
    static_assert(kConstantStepBudget == 0);
    return Pipeline(context, name, spirv, constants);
}

Pipeline packets(Context& context, const char* name, Words spirv, const Tuning& tuning,
                 std::uint32_t lanes, std::uint32_t light_packet_height = kLightPacketHeight) {
    if (lanes == 0) return {};
    // A device may count the loops of all clusters of a subgroup together.
    const std::uint32_t clusters = context.physical().info.subgroup_size / lanes;
    const std::uint32_t steps = tuning.step_budget < kStepBudget
                                    ? tuning.step_budget
                                    : std::max(kPacketStepBudget / clusters, 1u);
    const std::uint32_t constants[] = {steps, lanes, packet_run(context.physical()),
                                       light_packet_height};
    static_assert(kConstantStepBudget == 0 && kConstantPacketLanes == 1 &&
                  kConstantPacketRun == 2 && kConstantPacketHeight == 3);
    return Pipeline(context, name, spirv, constants);
}

}  // namespace

Kernels::Kernels(Context& context, const Tuning& tuning)
    : packet_lanes(gpu::packet_lanes(context.physical(), tuning)),
      primary(single_rays(context, "primary", k_primary_spirv, tuning)),
      camera_packet(
          packets(context, "camera packets", k_camera_packet_spirv, tuning, packet_lanes)),
      light_packet(packets(context, "light packets", k_light_packet_spirv, tuning, packet_lanes)),
      tall_light_packet(packets(context, "tall light packets", k_light_packet_spirv, tuning,
                                packet_lanes < 8 ? 0 : packet_lanes, kTallLightPacketHeight)),
      rays(single_rays(context, "rays", k_rays_spirv, tuning)),
      compact(context, "compact", k_compact_spirv),
      occlusion(single_rays(context, "occlusion", k_occlusion_spirv, tuning)),
      occlusion_packet(
          packets(context, "occlusion packets", k_occlusion_packet_spirv, tuning, packet_lanes)),
      resume(single_rays(context, "resume", k_resume_spirv, tuning)),
      shade(context, "shade", k_shade_spirv),
      refit_leaves(context, "refit leaves", k_refit_leaves_spirv),
      refit_nodes(context, "refit nodes", k_refit_nodes_spirv) {}

void Kernels::bind(const Bindings& bindings) {
    for (Pipeline* p :
         {&primary, &camera_packet, &light_packet, &tall_light_packet, &rays, &compact, &occlusion,
          &occlusion_packet, &resume, &shade, &refit_leaves, &refit_nodes}) {
        p->bind(bindings);
    }
}

void warm_up(Context& context, const Kernels& kernels) {
    context.submit("warm up", [&](VkCommandBuffer commands) {
        const auto dispatch = [&](const Pipeline& pipeline, const auto& arguments) {
            pipeline.dispatch(commands, arguments, 1);
            // Writer and reader: by its bindings each kernel may write what the next one reads.
            barrier(commands, VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT, VK_ACCESS_SHADER_WRITE_BIT,
                    VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT,
                    VK_ACCESS_SHADER_READ_BIT | VK_ACCESS_SHADER_WRITE_BIT);
        };
        RegionArguments nothing = {};
        nothing.tile_columns = 1;
        nothing.tile_count = 1;
        for (const Pipeline* p : {&kernels.primary, &kernels.compact, &kernels.shade})
            dispatch(*p, nothing);
        if (kernels.packet_lanes != 0) {
            dispatch(kernels.camera_packet, PacketArguments{});
            dispatch(kernels.light_packet, nothing);
            if (kernels.packet_lanes >= 8) dispatch(kernels.tall_light_packet, nothing);
            dispatch(kernels.occlusion_packet, OcclusionArguments{});
        }
        dispatch(kernels.occlusion, OcclusionArguments{});
        dispatch(kernels.rays, RaysArguments{});
        dispatch(kernels.resume, ResumeArguments{});
        dispatch(kernels.refit_leaves, RefitArguments{});
        dispatch(kernels.refit_nodes, RefitArguments{});
    });
}

}  // namespace mray::gpu
