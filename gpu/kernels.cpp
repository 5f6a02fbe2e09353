#include "gpu/kernels.h"

#include "gpu/camera_packets.h"

#include <algorithm>
#include <cstdint>

// Generated from shaders/*.comp; they use std::uint32_t without including it.
#include "shaders/occlusion/occlusion_packet_spirv.h"
#include "shaders/occlusion/occlusion_spirv.h"
#include "shaders/packet/camera_packet_spirv.h"
#include "shaders/packet/light_packet_spirv.h"
#include "shaders/refit/deform_spirv.h"
#include "shaders/refit/refit_leaves_spirv.h"
#include "shaders/refit/refit_nodes_spirv.h"
#include "shaders/shade/compact_spirv.h"
#include "shaders/shade/shade_spirv.h"
#include "shaders/single_ray/primary_spirv.h"
#include "shaders/single_ray/rays_spirv.h"
#include "shaders/single_ray/resume_spirv.h"

namespace morphray::gpu {
namespace {

Pipeline traversal(Context& context, const Pipeline::Source& source, const Tuning& tuning) {
    const std::uint32_t constants[] = {tuning.step_budget};
    static_assert(kConstantStepBudget == 0);
    return Pipeline(context, source, constants);
}

Pipeline packets(Context& context, const Pipeline::Source& source, const Tuning& tuning,
                 std::uint32_t lanes, std::uint32_t shadow_height = kShadowPacketHeight) {
    if (lanes == 0) return {};
    // The loops of all clusters of a subgroup may be counted together.
    const std::uint32_t clusters = context.physical().info.subgroup_size / lanes;
    const std::uint32_t steps = tuning.step_budget < kStepBudget
                                    ? tuning.step_budget
                                    : std::max(kPacketStepBudget / clusters, 1u);
    const std::uint32_t constants[] = {steps, lanes, packet_run(context.physical()), shadow_height};
    static_assert(kConstantStepBudget == 0 && kConstantPacketLanes == 1 &&
                  kConstantPacketRun == 2 && kConstantPacketHeight == 3);
    return Pipeline(context, source, constants);
}

Pipeline::Source shadow_source(const char* name) {
    return {name,
            k_light_packet_spirv,
            {kBindNodes, kBindLeaves, kBindPositions, kBindTriangles, kBindFoundHits,
             kBindOcclusion, kBindWork},
            sizeof(RegionArguments)};
}

}  // namespace

Kernels::Kernels(Context& context, const Tuning& tuning)
    : packet_lanes(gpu::packet_lanes(context.physical(), tuning)),
      primary(traversal(context,
                        {"primary",
                         k_primary_spirv,
                         {kBindNodes, kBindLeaves, kBindHits, kBindWork},
                         sizeof(RegionArguments)},
                        tuning)),
      primary_packet(packets(context,
                             {"primary packets",
                              k_camera_packet_spirv,
                              {kBindNodes, kBindLeaves, kBindHits, kBindWork},
                              sizeof(PacketArguments)},
                             tuning, packet_lanes)),
      shadow_packet(packets(context, shadow_source("shadow packets"), tuning, packet_lanes)),
      tall_shadow_packet(packets(context, shadow_source("tall shadow packets"), tuning,
                                 packet_lanes < 8 ? 0 : packet_lanes, kTallShadowPacketHeight)),
      rays(traversal(context,
                     {"rays",
                      k_rays_spirv,
                      {kBindNodes, kBindLeaves, kBindRays, kBindHits, kBindWork},
                      sizeof(RaysArguments)},
                     tuning)),
      select(context, {"select",
                       k_compact_spirv,
                       {kBindFoundHits, kBindOcclusion, kBindSeenOut, kBindWork},
                       sizeof(RegionArguments)}),
      occlusion(traversal(context,
                          {"occlusion",
                           k_occlusion_spirv,
                           {kBindNodes, kBindLeaves, kBindPositions, kBindTriangles, kBindSeen,
                            kBindFoundHits, kBindOcclusion, kBindWork},
                           sizeof(OcclusionArguments)},
                          tuning)),
      occlusion_packet(packets(context,
                               {"occlusion packets",
                                k_occlusion_packet_spirv,
                                {kBindNodes, kBindLeaves, kBindPositions, kBindTriangles, kBindSeen,
                                 kBindFoundHits, kBindOcclusion, kBindWork},
                                sizeof(OcclusionArguments)},
                               tuning, packet_lanes)),
      resume(
          traversal(context,
                    {"resume",
                     k_resume_spirv,
                     {kBindNodes, kBindLeaves, kBindHits, kBindOcclusion, kBindWork, kBindStates},
                     sizeof(ResumeArguments)},
                    tuning)),
      shade(context,
            {"shade",
             k_shade_spirv,
             {kBindPositions, kBindTriangles, kBindFoundHits, kBindFoundOcclusion, kBindPixels},
             sizeof(RegionArguments)}),
      deform(
          context,
          {"deform", k_deform_spirv, {kBindKeyframes, kBindPositionsOut}, sizeof(DeformArguments)}),
      refit_leaves(context,
                   {"refit leaves",
                    k_refit_leaves_spirv,
                    {kBindPose, kBindLeafVertices, kBindLeafParents, kBindNodesOut, kBindLeavesOut},
                    sizeof(RefitArguments)}),
      refit_nodes(context, {"refit nodes",
                            k_refit_nodes_spirv,
                            {kBindRefittedNodes, kBindNodeParents, kBindNodesOut},
                            sizeof(RefitArguments)}) {}

void Kernels::bind(const Bindings& bindings) {
    for (Pipeline* p :
         {&primary, &primary_packet, &shadow_packet, &tall_shadow_packet, &rays, &select,
          &occlusion, &occlusion_packet, &resume, &shade, &refit_leaves, &refit_nodes}) {
        p->bind(bindings);
    }
    if (bindings.views[kBindKeyframes] != VK_NULL_HANDLE) deform.bind(bindings);
}

}  // namespace morphray::gpu
