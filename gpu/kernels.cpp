#include "gpu/kernels.h"

#include <cstdint>

// Generated from shaders/*.comp; they use std::uint32_t without including it.
#include "shaders/occlusion_spirv.h"
#include "shaders/primary_spirv.h"
#include "shaders/rays_spirv.h"
#include "shaders/refit_leaves_spirv.h"
#include "shaders/refit_nodes_spirv.h"
#include "shaders/resume_spirv.h"
#include "shaders/shade_spirv.h"

namespace morphray::gpu {
namespace {

Pipeline traversal(Context& context, const Pipeline::Source& source, std::uint32_t step_budget) {
    const std::uint32_t constants[] = {step_budget};
    static_assert(kConstantStepBudget == 0);
    return Pipeline(context, source, constants);
}

}  // namespace

Kernels::Kernels(Context& context, std::uint32_t step_budget)
    : primary(traversal(context,
                        {"primary",
                         k_primary_spirv,
                         {kBindNodes, kBindLeaves, kBindHits, kBindWork},
                         sizeof(RegionArguments)},
                        step_budget)),
      rays(traversal(context,
                     {"rays",
                      k_rays_spirv,
                      {kBindNodes, kBindLeaves, kBindRays, kBindHits, kBindWork},
                      sizeof(RaysArguments)},
                     step_budget)),
      occlusion(traversal(context,
                          {"occlusion",
                           k_occlusion_spirv,
                           {kBindNodes, kBindLeaves, kBindPositions, kBindTriangles, kBindHits,
                            kBindOcclusion, kBindWork},
                           sizeof(RegionArguments)},
                          step_budget)),
      resume(
          traversal(context,
                    {"resume",
                     k_resume_spirv,
                     {kBindNodes, kBindLeaves, kBindHits, kBindOcclusion, kBindWork, kBindStates},
                     sizeof(ResumeArguments)},
                    step_budget)),
      shade(context,
            {"shade",
             k_shade_spirv,
             {kBindPositions, kBindTriangles, kBindAlbedo, kBindHits, kBindOcclusion, kBindPixels},
             sizeof(RegionArguments)}),
      refit_leaves(context, {"refit leaves",
                             k_refit_leaves_spirv,
                             {kBindLeaves, kBindPositions, kBindLeafVertices, kBindLeafParents,
                              kBindNodesOut, kBindLeavesOut},
                             sizeof(RefitArguments)}),
      refit_nodes(context, {"refit nodes",
                            k_refit_nodes_spirv,
                            {kBindNodes, kBindNodeParents, kBindNodesOut},
                            sizeof(RefitArguments)}) {}

void Kernels::bind(const Bindings& bindings) {
    for (Pipeline* p :
         {&primary, &rays, &occlusion, &resume, &shade, &refit_leaves, &refit_nodes}) {
        p->bind(bindings);
    }
}

}  // namespace morphray::gpu
