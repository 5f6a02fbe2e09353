// The compiled kernels of the backend.
#pragma once

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
};

inline const Kernel kKernels[] = {
    {"closest", k_closest_spirv},
    {"closest_storage", k_closest_storage_spirv},
    {"compact", k_compact_spirv},
    {"compact_storage", k_compact_storage_spirv},
    {"hits", k_hits_spirv},
    {"hits_storage", k_hits_storage_spirv},
    {"occlusion", k_occlusion_spirv},
    {"occlusion_storage", k_occlusion_storage_spirv},
    {"primary", k_primary_spirv},
    {"primary_storage", k_primary_storage_spirv},
    {"rays", k_rays_spirv},
    {"rays_storage", k_rays_storage_spirv},
    {"refit_leaves", k_refit_leaves_spirv},
    {"refit_leaves_storage", k_refit_leaves_storage_spirv},
    {"refit_nodes", k_refit_nodes_spirv},
    {"refit_nodes_storage", k_refit_nodes_storage_spirv},
    {"resume", k_resume_spirv},
    {"resume_storage", k_resume_storage_spirv},
    {"shade", k_shade_spirv},
    {"shade_storage", k_shade_storage_spirv},
    {"winding", k_winding_spirv},
    {"winding_storage", k_winding_storage_spirv},
};

}  // namespace mray::test
