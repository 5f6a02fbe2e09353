// The compiled kernels of the backend.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "shaders/kernel_interface.h"
#include "shaders/occlusion/occlusion_spirv.h"
#include "shaders/occlusion/occlusion_storage_spirv.h"
#include "shaders/queries/closest_spirv.h"
#include "shaders/queries/closest_storage_spirv.h"
#include "shaders/queries/hits_spirv.h"
#include "shaders/queries/hits_storage_spirv.h"
#include "shaders/queries/winding_spirv.h"
#include "shaders/queries/winding_storage_spirv.h"
#include "shaders/refit/refit_leaves_spirv.h"
#include "shaders/refit/refit_leaves_storage_spirv.h"
#include "shaders/refit/refit_nodes_spirv.h"
#include "shaders/refit/refit_nodes_storage_spirv.h"
#include "shaders/shade/compact_spirv.h"
#include "shaders/shade/compact_storage_spirv.h"
#include "shaders/shade/shade_spirv.h"
#include "shaders/shade/shade_storage_spirv.h"
#include "shaders/single_ray/primary_spirv.h"
#include "shaders/single_ray/primary_storage_spirv.h"
#include "shaders/single_ray/rays_spirv.h"
#include "shaders/single_ray/rays_storage_spirv.h"
#include "shaders/single_ray/resume_spirv.h"
#include "shaders/single_ray/resume_storage_spirv.h"

namespace mray::test {

struct Kernel {
    const char* name;
    std::span<const std::uint32_t> words;
    /// The size of its push constants.
    std::size_t argument_bytes;
};

inline const Kernel kKernels[] = {
    {"closest", k_closest_spirv, sizeof(QueryArguments)},
    {"closest_storage", k_closest_storage_spirv, sizeof(QueryArguments)},
    {"compact", k_compact_spirv, sizeof(RegionArguments)},
    {"compact_storage", k_compact_storage_spirv, sizeof(RegionArguments)},
    {"hits", k_hits_spirv, sizeof(QueryArguments)},
    {"hits_storage", k_hits_storage_spirv, sizeof(QueryArguments)},
    {"occlusion", k_occlusion_spirv, sizeof(OcclusionArguments)},
    {"occlusion_storage", k_occlusion_storage_spirv, sizeof(OcclusionArguments)},
    {"primary", k_primary_spirv, sizeof(RegionArguments)},
    {"primary_storage", k_primary_storage_spirv, sizeof(RegionArguments)},
    {"rays", k_rays_spirv, sizeof(RaysArguments)},
    {"rays_storage", k_rays_storage_spirv, sizeof(RaysArguments)},
    {"refit_leaves", k_refit_leaves_spirv, sizeof(RefitArguments)},
    {"refit_leaves_storage", k_refit_leaves_storage_spirv, sizeof(RefitArguments)},
    {"refit_nodes", k_refit_nodes_spirv, sizeof(RefitArguments)},
    {"refit_nodes_storage", k_refit_nodes_storage_spirv, sizeof(RefitArguments)},
    {"resume", k_resume_spirv, sizeof(ResumeArguments)},
    {"resume_storage", k_resume_storage_spirv, sizeof(ResumeArguments)},
    {"shade", k_shade_spirv, sizeof(RegionArguments)},
    {"shade_storage", k_shade_storage_spirv, sizeof(RegionArguments)},
    {"winding", k_winding_spirv, sizeof(QueryArguments)},
    {"winding_storage", k_winding_storage_spirv, sizeof(QueryArguments)},
};

}  // namespace mray::test
